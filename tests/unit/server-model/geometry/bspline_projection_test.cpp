// The closest point of a B-spline surface (issue: "agreeing with OCCT to 1e-9"): against formulas, against
// OCCT, against looking everywhere, and where a search by seeds goes wrong.

#include "server-model/geometry/bspline_projection.h"

#include <gtest/gtest.h>

#include <GeomAPI_ProjectPointOnSurf.hxx>
#include <limits>
#include <thread>

#include "tests/unit/server-model/geometry/bspline_shapes.h"

namespace handloft::geometry {
namespace {

using samples::Random;
using samples::uniform;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double inf = std::numeric_limits<double>::infinity();

SurfaceProjector made(const BSplineSurface& surface, std::vector<TrimLoop> loops = {}) {
  auto projector = SurfaceProjector::create(surface, std::move(loops));
  EXPECT_TRUE(projector.ok()) << (projector.ok() ? "" : projector.error().describe());
  return *std::move(projector);
}

Vec3 random_place(Random& random, double extent) {
  return {uniform(random, -extent, extent), uniform(random, -extent, extent),
          uniform(random, -extent, extent)};
}

/// What every answer must satisfy: its place is the surface's at its parameters, its distance that place's.
void expect_consistent(const BSplineSurface& surface, const Vec3& place, const ClosestOnSurface& answer) {
  EXPECT_LT((surface.evaluate(answer.uv.x(), answer.uv.y()) - answer.place).norm(), 1e-13);
  EXPECT_DOUBLE_EQ((answer.place - place).norm(), answer.distance_m);
  EXPECT_GE(answer.uv.x(), surface.u.lower());
  EXPECT_LE(answer.uv.x(), surface.u.upper());
  EXPECT_GE(answer.uv.y(), surface.v.lower());
  EXPECT_LE(answer.uv.y(), surface.v.upper());
}

/// Least distance over a dense grid, then halving steps around its best places: slow, but it trusts nothing.
double by_looking_everywhere(const BSplineSurface& surface, const Vec3& place) {
  constexpr int n = 60;
  const Vec2 low(surface.u.lower(), surface.v.lower());
  const Vec2 extent(surface.u.length(), surface.v.length());
  std::vector<std::pair<double, Vec2>> found;
  const auto distance = [&](const Vec2& uv) { return (surface.evaluate(uv.x(), uv.y()) - place).norm(); };
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j <= n; ++j) {
      const Vec2 uv = low + extent.cwiseProduct(Vec2(i, j) / n);
      found.emplace_back(distance(uv), uv);
    }
  }
  std::partial_sort(found.begin(), found.begin() + 20, found.end(),
                    [](const auto& a, const auto& b) { return a.first < b.first; });
  double best = inf;
  for (int k = 0; k < 20; ++k) {
    auto [least, at] = found[static_cast<std::size_t>(k)];
    for (Vec2 step = extent / n; step.maxCoeff() > 1e-12;) {
      bool moved = false;
      for (int a = -1; a <= 1; ++a) {
        for (int b = -1; b <= 1; ++b) {
          const Vec2 uv = (at + step.cwiseProduct(Vec2(a, b))).cwiseMax(low).cwiseMin(low + extent);
          if (const double d = distance(uv); d < least) least = d, at = uv, moved = true;
        }
      }
      if (!moved) step /= 2;
    }
    best = std::min(best, least);
  }
  return best;
}

TEST(BSplineProjection, PlaneIsExact) {
  const BSplineSurface surface = samples::flat(2, 1, 9, 7);
  const SurfaceProjector projector = made(surface);
  Random random(1);
  for (int k = 0; k < 2000; ++k) {
    const Vec3 place = random_place(random, 3);
    const ClosestOnSurface answer = *projector.closest(place);
    const Vec3 expected(std::clamp(place.x(), 0.0, 2.0), std::clamp(place.y(), 0.0, 1.0), 0);
    ASSERT_LT((answer.place - expected).norm(), 1e-12) << place.transpose();
    ASSERT_EQ(answer.gap_m, 0);
    expect_consistent(surface, place, answer);
  }
}

TEST(BSplineProjection, SphereIsExactInsideAndOutside) {
  const BSplineSurface surface = samples::sphere(0.5);
  const SurfaceProjector projector = made(surface);
  Random random(2);
  for (int k = 0; k < 2000; ++k) {
    const Vec3 place = random_place(random, k % 2 == 0 ? 0.6 : 5);
    const ClosestOnSurface answer = *projector.closest(place);
    ASSERT_NEAR(answer.distance_m, std::abs(place.norm() - 0.5), 1e-12) << place.transpose();
    ASSERT_LT((answer.place - 0.5 * place.normalized()).norm(), 1e-11) << place.transpose();
    expect_consistent(surface, place, answer);
  }
}

// Everything is equally near: the first answer is as good as any, and known to be.
TEST(BSplineProjection, SphereCentreIsAnsweredAndSure) {
  const SurfaceProjector projector = made(samples::sphere(0.5));
  const ClosestOnSurface answer = *projector.closest(Vec3::Zero());
  EXPECT_NEAR(answer.distance_m, 0.5, 1e-12);
  EXPECT_EQ(answer.gap_m, 0);
}

TEST(BSplineProjection, SpherePolesAndSeam) {
  const SurfaceProjector projector = made(samples::sphere(0.5));
  for (const double z : {-3.0, -0.5, -0.2, 0.2, 0.5, 3.0}) {
    const ClosestOnSurface answer = *projector.closest(Vec3(0, 0, z));
    EXPECT_NEAR(answer.distance_m, std::abs(std::abs(z) - 0.5), 1e-12) << z;
    // Beside the pole the distance is flat: 1e-12 in it is up to 1e-6 along the sphere.
    EXPECT_LT((answer.place - Vec3(0, 0, std::copysign(0.5, z))).norm(), 1e-6) << z;
    // A hair beside the pole.
    const Vec3 beside(1e-9, -1e-9, z);
    EXPECT_NEAR(projector.closest(beside)->distance_m, std::abs(beside.norm() - 0.5), 1e-12) << z;
  }
  for (const double y : {-1e-9, 0.0, 1e-9}) {  // The seam lies at y = 0, x > 0.
    const Vec3 place(0.7, y, 0.1);
    EXPECT_NEAR(projector.closest(place)->distance_m, place.norm() - 0.5, 1e-12);
  }
}

TEST(BSplineProjection, TorusIsExactAlsoOnItsMedialAxis) {
  const SurfaceProjector projector = made(samples::torus(1, 0.3));
  const auto expected = [](const Vec3& p) {
    return std::abs(std::hypot(std::hypot(p.x(), p.y()) - 1, p.z()) - 0.3);
  };
  Random random(3);
  for (int k = 0; k < 1000; ++k) {
    const Vec3 place = random_place(random, 1.5);
    ASSERT_NEAR(projector.closest(place)->distance_m, expected(place), 1e-12) << place.transpose();
  }
  for (const Vec3& place :
       {Vec3(0, 0, 0), Vec3(0, 0, 0.4), Vec3(0, 0, -2), Vec3(1, 0, 0), Vec3(0, -1, 0), Vec3(0.6, 0.8, 0)}) {
    const ClosestOnSurface answer = *projector.closest(place);
    EXPECT_NEAR(answer.distance_m, expected(place), 1e-11) << place.transpose();
    EXPECT_LE(answer.gap_m, 1e-11);
  }
}

TEST(BSplineProjection, AgreesWithLookingEverywhere) {
  Random random(4);
  for (const samples::Kind u : samples::kinds) {
    for (const samples::Kind v : samples::kinds) {
      for (const samples::Weights weights : {samples::Weights::none, samples::Weights::random}) {
        const int p = 1 + static_cast<int>(random() % 4), q = 1 + static_cast<int>(random() % 4);
        const BSplineSurface surface = samples::random_surface(random, u, v, p, q, weights);
        const SurfaceProjector projector = made(surface);
        for (int k = 0; k < 3; ++k) {
          const Vec3 place = random_place(random, k == 0 ? 5 : 1);
          const ClosestOnSurface answer = *projector.closest(place);
          // Looking everywhere may miss the truth, but never finds a nearer place.
          ASSERT_LE(answer.distance_m, by_looking_everywhere(surface, place) + 1e-10)
              << "degrees " << p << ", " << q << " from " << place.transpose();
          ASSERT_LT(answer.gap_m, 1e-10);
          expect_consistent(surface, place, answer);
        }
      }
    }
  }
}

TEST(BSplineProjection, AgreesWithOcct) {
  const BSplineSurface surface = samples::wavy(20, 20);
  const SurfaceProjector projector = made(surface);
  const Handle(Geom_BSplineSurface) theirs = samples::to_occt(surface);
  Random random(5);
  int equal = 0;
  constexpr int count = 60;
  for (int k = 0; k < count; ++k) {
    const Vec3 on = surface.evaluate(uniform(random, 0.05, 0.95), uniform(random, 0.05, 0.95));
    const Vec3 place = on + random_place(random, k % 3 == 0 ? 1 : 0.03);
    const GeomAPI_ProjectPointOnSurf other(gp_Pnt(place.x(), place.y(), place.z()), theirs);
    const double ours = projector.closest(place)->distance_m;
    // OCCT gives the extrema inside and no answer at edges: never nearer, and as near when inside.
    if (other.NbPoints() == 0) continue;
    ASSERT_LE(ours, other.LowerDistance() + 1e-9) << place.transpose();
    equal += std::abs(ours - other.LowerDistance()) <= 1e-9 ? 1 : 0;
  }
  EXPECT_GT(equal, count * 2 / 3);
}

TEST(BSplineProjection, SeedsNeverChangeTheAnswer) {
  const BSplineSurface surface = samples::wavy(20, 20);
  const SurfaceProjector projector = made(surface);
  Random random(6);
  for (int k = 0; k < 300; ++k) {
    const Vec3 place = Vec3(0.5, 0.5, 0) + random_place(random, 1);
    const double expected = projector.closest(place)->distance_m;
    for (const Vec2& seed : {Vec2(0, 0), Vec2(uniform(random, 0, 1), uniform(random, 0, 1)), Vec2(9, -9),
                             Vec2(nan, 0), Vec2(inf, 0)}) {
      ASSERT_NEAR(projector.closest(place, seed)->distance_m, expected, 2e-12) << seed.transpose();
    }
  }
}

/// Three surfaces that the property test has found, of few control points and with their weights.
struct Found {
  BSplineSurface surface;
  Vec3 place;
};

Found ruled_loop() {
  return {{KnotVector::uniform(1, 3).value(),
           KnotVector::uniform_periodic(1, 2).value(),
           {{0.34644126892089844, 0.62917327880859375, -1},
            {-0.5997314453125, -0.18981361389160156, -1},
            {-1, -1, -1},
            {0.42739105224609375, -0.25506782531738281, -0.43813133239746094},
            {0.78682327270507812, -0.30356788635253906, -1},
            {0.33608627319335938, 0.40778350830078125, -1}},
           {0.75208139419555664, 1.2040675163269043, 0.54247255325317378, 2.7139237403869627, 0.3, 0.3}},
          {4.5366477966308594, 2.5119400024414062, -1.1923027038574219}};
}

Found creased_band() {
  return {{KnotVector::uniform(4, 6).value(),
           KnotVector::uniform(1, 2).value(),
           {{-1, -1, -0.35419845581054688},
            {-1, -1, -0.4855804443359375},
            {-0.37681007385253906, 0.19583511352539062, 0.76951789855957031},
            {-1, -1, -0.38738059997558594},
            {-0.37469100952148438, 0.73258018493652344, -0.88978958129882812},
            {0.60066604614257812, -1, -0.50032424926757812},
            {-0.609130859375, -1, 0.80897712707519531},
            {-0.52521514892578125, -0.60149383544921875, -0.36600303649902344},
            {0.44203948974609375, -0.85241508483886719, -0.91298675537109375},
            {-0.38801670074462891, -1.5, 0.34675025939941406},
            {0.97125816345214844, -1, -0.41012954711914062},
            {-0.67933845520019531, -0.48622512817382812, -0.20713996887207031}},
           {0.3, 0.3, 0.54208889007568362, 0.3, 1.3926547050476075, 2.8185633659362792, 1.9753463745117188,
            1.2341837882995605, 1.3272980690002443, 0.41817340850830076, 0.37520570755004884, 0.3}},
          {-0.9658966064453125, -0.033565521240234375, -1.5102386474609375}};
}

Found steep_band() {
  return {
      {KnotVector::uniform(3, 6).value(),
       KnotVector::uniform(1, 2).value(),
       {{0.0032787322998046875, -0.9380035400390625, 0.62582015991210938},
        {0.72506904602050781, 0.60131645202636719, 0.89910888671875},
        {-0.066980361938476562, 0.79704856872558594, -0.42549514770507812},
        {-0.00516510009765625, -0.57534027099609375, -0.69639015197753906},
        {-0.56533908843994141, 0.72620582580566406, 0.24729251861572266},
        {-0.41744804382324219, 0.56179046630859375, 0.5877838134765625},
        {-1, -0.97771835327148438, 0.45556640625},
        {-0.34852027893066406, -0.17710494995117188, -0.056348800659179688},
        {-1, -1, -1},
        {-1, -1, -0.74795341491699219},
        {-1, -1, -0.68987846374511719},
        {-1, -1, -1}},
       {1.9155798912048341, 2.1560156822204593, 2.6439348220825196, 0.4771751403808594, 2.9253247261047362,
        0.45787353515625001, 0.3, 1.3491514205932618, 0.3, 0.3, 2.5301078796386718, 0.3}},
      {1.35150146484375, -1.1114006042480469, -1.3418693542480469}};
}

// The distance to a rational surface may have one minimum among what is nearer than the best so far, and
// others above it, in which Newton's method ends.
TEST(BSplineProjection, RationalSurfacesAreSearchedToTheEnd) {
  const Found loop = ruled_loop();
  const double nearest = by_looking_everywhere(loop.surface, loop.place);
  EXPECT_NEAR(made(loop.surface).closest(loop.place)->distance_m, nearest, 1e-11);

  const Found band = creased_band();
  const SurfaceProjector projector = made(band.surface);
  EXPECT_NEAR(projector.closest(band.place)->distance_m, by_looking_everywhere(band.surface, band.place),
              1e-11);
  EXPECT_NEAR(projector.closest(band.place, Vec2(0, 0))->distance_m,
              projector.closest(band.place)->distance_m, 1e-11);
}

// Along a side behind which the surface would come nearer still, the squared distance bends down across it.
TEST(BSplineProjection, ASideTowardsWhichTheDistanceFallsIsFollowedToTheEnd) {
  const auto [surface, place] = steep_band();
  EXPECT_NEAR(made(surface).closest(place)->distance_m, by_looking_everywhere(surface, place), 1e-11);
}

TEST(BSplineProjection, FarPlacesKeepTheirDigits) {
  const BSplineSurface surface = samples::wavy(30, 30);
  const SurfaceProjector projector = made(surface);
  for (const double far : {10.0, 1e3, 1e6, 1e12, 1e50}) {
    for (const Vec3& direction : {Vec3(1, 2, 3), Vec3(-1, 0.1, -4), Vec3(0, 0, 1), Vec3(1, 0, 0)}) {
      const Vec3 place = far * direction.normalized();
      const ClosestOnSurface answer = *projector.closest(place);
      double sampled = inf;
      for (int i = 0; i <= 50; ++i) {
        for (int j = 0; j <= 50; ++j) {
          sampled = std::min(sampled, (surface.evaluate(i / 50.0, j / 50.0) - place).norm());
        }
      }
      EXPECT_LE(answer.distance_m, sampled * (1 + 1e-14) + 1e-12) << place.transpose();
      EXPECT_LE(answer.gap_m, 1e-9 * far) << place.transpose();
      expect_consistent(surface, place, answer);
    }
  }
}

TEST(BSplineProjection, RefitEqualsMakingItAnewToTheBit) {
  for (const bool rational : {false, true}) {
    BSplineSurface surface = samples::wavy(20, 15);
    if (rational) surface.weights.assign(surface.control.size(), 1.5);
    SurfaceProjector kept = made(surface);
    Random random(7);
    for (int frame = 0; frame < 10; ++frame) {
      const std::size_t moved = random() % surface.control.size();
      surface.control[moved] += random_place(random, 0.05);
      ASSERT_TRUE(kept.refit(surface.control).ok());
      const SurfaceProjector fresh = made(surface);
      for (int k = 0; k < 50; ++k) {
        const Vec3 place = surface.control[moved] + random_place(random, 0.2);
        const ClosestOnSurface a = *kept.closest(place), b = *fresh.closest(place);
        ASSERT_EQ(a.distance_m, b.distance_m);
        ASSERT_EQ(a.uv, b.uv);
      }
    }
    surface.control[3].x() = nan;
    EXPECT_EQ(kept.refit(surface.control).error().code, ErrorCode::invalid_argument);
    EXPECT_EQ(kept.refit(surface.control).error().field, "control[3]");
    surface.control.pop_back();
    EXPECT_FALSE(kept.refit(surface.control).ok());
  }
}

TEST(BSplineProjection, BatchesAnswerAlikeWithAnyThreads) {
  const BSplineSurface surface = samples::wavy(20, 20);
  const SurfaceProjector projector = made(surface);
  Random random(8);
  std::vector<Vec3> places(3000);
  for (Vec3& p : places) p = Vec3(0.5, 0.5, 0) + random_place(random, 0.6);
  std::vector<ClosestOnSurface> one(places.size()), two(places.size());
  ASSERT_TRUE(projector.closest(places, one).ok());
  const ParallelFor threads = [](std::size_t count, const std::function<void(std::size_t)>& task) {
    std::thread other([&] {
      for (std::size_t k = 1; k < count; k += 2) task(k);
    });
    for (std::size_t k = 0; k < count; k += 2) task(k);
    other.join();
  };
  ASSERT_TRUE(projector.closest(places, two, threads).ok());
  for (std::size_t k = 0; k < places.size(); ++k) {
    ASSERT_EQ(one[k].distance_m, two[k].distance_m);
    ASSERT_EQ(one[k].uv, projector.closest(places[k])->uv);
  }
  places[7].y() = inf;
  EXPECT_EQ(projector.closest(places, one).error().field, "places[7]");
  EXPECT_EQ(projector.closest(places, std::span(one).first(5)).error().field, "answers");
}

TEST(BSplineProjection, RefusesWhatIsNotFinite) {
  const SurfaceProjector projector = made(samples::wavy(8, 8));
  for (const Vec3& bad : {Vec3(nan, 0, 0), Vec3(0, inf, 0), Vec3(0, 0, -inf), Vec3(0, 1e200, 0)}) {
    EXPECT_EQ(projector.closest(bad).error().code, ErrorCode::invalid_argument);
    EXPECT_EQ(projector.closest(bad, Vec2(0.5, 0.5)).error().code, ErrorCode::invalid_argument);
    EXPECT_EQ(projector.ray(bad, Vec3::UnitX()).error().field, "origins");
    EXPECT_EQ(projector.ray(Vec3::Zero(), bad).error().field, "directions");
  }
  EXPECT_EQ(projector.ray(Vec3::Zero(), Vec3::Zero()).error().field, "directions");
  BSplineSurface broken = samples::wavy(8, 8);
  broken.control[5].z() = nan;
  EXPECT_FALSE(SurfaceProjector::create(broken).ok());
}

// A surface that is one point everywhere: no tangent anywhere.
TEST(BSplineProjection, CollapsedSurfacesAnswer) {
  BSplineSurface surface = samples::wavy(8, 8);
  for (Vec3& p : surface.control) p = Vec3(1, 2, 3);
  EXPECT_NEAR(made(surface).closest(Vec3(1, 2, 5))->distance_m, 2, 1e-15);
  for (std::size_t k = 0; k < surface.control.size(); ++k)
    surface.control[k] = Vec3(0.1 * static_cast<double>(k / 8), 0, 0);
  EXPECT_NEAR(made(surface).closest(Vec3(0.3, 1, 0))->distance_m, 1, 1e-12);
  EXPECT_NEAR(made(surface).closest(Vec3(-3, 0, 4))->distance_m, 5, 1e-12);
}

TrimLoop square(double low, double high) {
  return {{low, low}, {high, low}, {high, high}, {low, high}};
}

TEST(BSplineProjection, LoopsRestrictTheAnswer) {
  const BSplineSurface surface = samples::flat(1, 1, 12, 12);
  const SurfaceProjector projector = made(surface, {square(0.2, 0.8), square(0.4, 0.6)});
  Random random(9);
  for (int k = 0; k < 1000; ++k) {
    const Vec3 place(uniform(random, -0.2, 1.2), uniform(random, -0.2, 1.2), uniform(random, -0.5, 0.5));
    Vec2 q(std::clamp(place.x(), 0.2, 0.8), std::clamp(place.y(), 0.2, 0.8));
    const Vec2 from_hole = q - Vec2(0.5, 0.5);
    if (from_hole.cwiseAbs().maxCoeff() < 0.1) {  // Out of the hole by the nearer side.
      const int axis = std::abs(from_hole.x()) > std::abs(from_hole.y()) ? 0 : 1;
      q[axis] = 0.5 + std::copysign(0.1, from_hole[axis]);
    }
    const ClosestOnSurface answer = *projector.closest(place);
    ASSERT_NEAR(answer.distance_m, (Vec3(q.x(), q.y(), 0) - place).norm(), 1e-12) << place.transpose();
    ASSERT_EQ(answer.gap_m, 0);
  }
  EXPECT_FALSE((*projector.ray(Vec3(0.5, 0.5, 1), -Vec3::UnitZ())).has_value());
  EXPECT_FALSE((*projector.ray(Vec3(0.1, 0.5, 1), -Vec3::UnitZ())).has_value());
  EXPECT_TRUE((*projector.ray(Vec3(0.3, 0.5, 1), -Vec3::UnitZ())).has_value());
}

TEST(BSplineProjection, LoopsRestrictBentAndRationalSurfacesToo) {
  Random random(10);
  for (const samples::Weights weights : {samples::Weights::none, samples::Weights::random}) {
    const BSplineSurface surface =
        samples::random_surface(random, samples::Kind::clamped, samples::Kind::clamped, 3, 2, weights);
    TrimLoop loop;
    const Vec2 middle(surface.u.lower() + surface.u.length() / 2, surface.v.lower() + surface.v.length() / 2);
    for (int k = 0; k < 40; ++k) {
      const double turn = 2 * M_PI * k / 40;
      loop.emplace_back(middle.x() + 0.3 * surface.u.length() * std::cos(turn),
                        middle.y() + 0.3 * surface.v.length() * std::sin(turn));
    }
    const TrimRegion region = *TrimRegion::create({loop}, {surface.u.lower(), surface.v.lower()},
                                                  {surface.u.upper(), surface.v.upper()});
    const SurfaceProjector projector = made(surface, {loop});
    for (int k = 0; k < 20; ++k) {
      const Vec3 place = random_place(random, 1.5);
      const ClosestOnSurface answer = *projector.closest(place);
      const Vec2 inwards = answer.uv + 1e-9 * (middle - answer.uv);
      EXPECT_TRUE(region.inside(inwards)) << answer.uv.transpose();
      for (int s = 0; s < 2000; ++s) {
        const Vec2 uv(uniform(random, surface.u.lower(), surface.u.upper()),
                      uniform(random, surface.v.lower(), surface.v.upper()));
        if (!region.inside(uv)) continue;
        ASSERT_LE(answer.distance_m, (surface.evaluate(uv.x(), uv.y()) - place).norm() + 1e-12);
      }
    }
  }
}

TEST(BSplineProjection, RefusesLoopsThatAreNone) {
  const BSplineSurface surface = samples::wavy(8, 8);
  const auto error = [&](std::vector<TrimLoop> loops) {
    const auto projector = SurfaceProjector::create(surface, std::move(loops));
    return projector.ok() ? std::string() : projector.error().field;
  };
  EXPECT_EQ(error({{{0, 0}, {1, 1}}}), "loops[0]");
  EXPECT_EQ(error({square(0.1, 0.9), {{0, 0}, {0, 0}, {1, 1}}}), "loops[1]");
  EXPECT_EQ(error({{{0, 0}, {1, nan}, {1, 1}}}), "loops[0][1]");
  EXPECT_EQ(error({square(0.1, 2)}), "loops[0][1]");
}

}  // namespace
}  // namespace handloft::geometry
