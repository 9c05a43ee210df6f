// ModifyProfile on documents: A8 - A10, A19, A20, A28 and what is refused. A12 and A21 have files of their
// own.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "profile_helpers.h"

namespace handloft::model::test {
namespace {

// What a gesture keeps between two frames must not be seen in any result.
TEST(ModifyProfile, A19_AGestureGivesToTheBitWhatOneOperationGives) {
  Document base = fitted("a", random_points(200, 1), 3);
  base = fitted("b", random_points(150, 2, 0.09), 2, std::move(base));
  base = applied(std::move(base), {symmetry("b", v1::SetSymmetry::PARTNER, 0.2)});
  base = applied(std::move(base), {add("b", random_points(20, 3, 0.09)), fit("b")});
  base = applied(std::move(base), {add("a", random_points(10, 4))});  // A stale fit (A9).
  const auto expect_as_alone = [](const Provisional& gesture, const Document& on,
                                  const v1::Operation& operation) {
    EXPECT_EQ(document_hash(gesture.result()), document_hash(must(on, operation).document));
  };
  std::vector<v1::Operation> frames;
  const auto long_stroke = line({-0.04, 0, 0.03}, {0.13, 0.01, 0.02});
  for (const std::size_t n : {20U, 40U, 60U}) {
    frames.push_back(
        profile({curve({long_stroke.begin(), long_stroke.begin() + static_cast<std::ptrdiff_t>(n)})}));
  }
  frames.push_back(profile({curve(long_stroke), curve(arch(0.03), "a")}, true));
  auto gesture = Provisional::begin(base, frames.front());
  ASSERT_TRUE(gesture.ok()) << gesture.error().describe();
  for (const v1::Operation& frame : frames) {
    ASSERT_TRUE(gesture->update(frame).ok());
    expect_as_alone(*gesture, base, frame);
  }
  // The base changes beneath it: what was kept is of another shape now.
  const Document other = applied(base, {add("a", random_points(30, 5)), fit("a", 2)});
  ASSERT_TRUE(gesture->rebase(other).ok());
  expect_as_alone(*gesture, other, frames.back());
  ASSERT_TRUE(gesture->update(frames.front()).ok());
  expect_as_alone(*gesture, other, frames.front());
  EXPECT_NE(document_hash(must(base, frames.front()).document), document_hash(gesture->result()));
  ASSERT_TRUE(gesture->rebase(base).ok());
  expect_as_alone(*gesture, base, frames.front());
}

TEST(ModifyProfile, A8_A19_SurfaceFollowsAndRefitKeepsIt) {
  for (std::uint32_t degree = 1; degree <= 4; ++degree) {
    for (const std::size_t n : {7U, 40U, 1000U}) {
      const Document before = fitted("a", random_points(n, degree), degree);
      const ApplyResult result =
          must(before, profile({curve(arch(0.03), "a"), curve(arch(0.02, 0.02), "a")}));
      const DualPtr a = before.find_dual("a");
      const DualPtr b = result.document.find_dual("a");
      ASSERT_EQ(b->points.size(), n);  // Temporaries are gone.
      EXPECT_EQ(b->fit->surface.degree(), a->fit->surface.degree());
      EXPECT_FALSE(b->stale);
      EXPECT_FALSE(a->fit->surface == b->fit->surface);
      EXPECT_LE(refit_error(*b), 1e-9) << degree << ", " << n;
      EXPECT_EQ(b->fit->frame.rotation, a->fit->frame.rotation);  // The frame is frozen.
      const auto x = local_points(*a);
      const auto y = local_points(*b);
      for (std::size_t i = 0; i < n; ++i) {
        EXPECT_LE((x[i].position - y[i].position).head<2>().norm(), 1e-15);
        EXPECT_NEAR(height_over(*b, b->points[i].position()), b->residual_m(i), 1e-15);
        EXPECT_EQ(b->points[i].pressure, a->points[i].pressure);
      }
      // A fit afterwards has nothing to do, and after a change of degree and back it finds f1 again.
      EXPECT_TRUE(must(result.document, fit("a")).changes.empty());
    }
  }
}

TEST(ModifyProfile, A19_TheSurfaceComesNearerToTheCurve) {
  const Document before = fitted("a", random_points(300, 1));
  const auto points = arch(0.03);
  const Document after = must(before, profile({curve(points, "a")})).document;
  double old_distance = 0;
  double new_distance = 0;
  for (const auto& p : points) {
    const Vec3 at(p.position().x(), p.position().y(), p.position().z());
    old_distance += std::abs(height_over(*before.find_dual("a"), at));
    new_distance += std::abs(height_over(*after.find_dual("a"), at));
  }
  EXPECT_LT(new_distance, 0.5 * old_distance);
}

TEST(ModifyProfile, A19_OrderAndDirectionOfCurvesChangeNothing) {
  const Document before = fitted("a", random_points(101, 2), 3);
  std::vector<v1::ProfileCurve> curves = {curve(arch(0.03), "a"), curve(arch(0.03, 0.02), "a")};
  const std::string hash = document_hash(must(before, profile(curves)).document);
  std::swap(curves[0], curves[1]);
  auto reversed = arch(0.03);
  std::reverse(reversed.begin(), reversed.end());
  curves[1] = curve(reversed, "a");
  EXPECT_EQ(document_hash(must(before, profile(curves)).document), hash);  // To the bit.
}

TEST(ModifyProfile, A19_ACurveOnTheSurfaceChangesNothing) {
  const Document before = fitted("a", random_points(200, 3), 1);
  const DualPtr a = before.find_dual("a");
  const auto on_it = stroke(
      [&](double t) { return a->fit->surface.world_point(a->fit->frame, -0.03 + 0.06 * t, 0.01 * t); });
  const Document after = must(before, profile({curve(on_it, "a")})).document;
  for (std::size_t i = 0; i < a->points.size(); ++i) {
    EXPECT_LE((after.find_dual("a")->points[i].position() - a->points[i].position()).norm(), 1e-12);
  }
}

TEST(ModifyProfile, A19_ARulingDrawnOnASaddleChangesNothing) {
  // A straight line that lies on the surface stays there through smoothing and even resampling.
  std::vector<v1::Point> points = saddle_points();
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].mutable_position()->set_z(points[i].position().z() +
                                        1e-3 * std::sin(7.0 * static_cast<double>(i)));
  }
  const Document before = fitted("a", points);
  const DualPtr a = before.find_dual("a");
  const auto& f = a->fit->surface;
  const geometry::HeightDerivatives d = f.derivatives(0.002, 0.001);
  ASSERT_LT(d.dxx * d.dyy - d.dxy * d.dxy, 0);
  // f along (1, m) is straight where dxx + 2 m dxy + m^2 dyy = 0.
  const double m = (-d.dxy + std::sqrt(d.dxy * d.dxy - d.dxx * d.dyy)) / d.dyy;
  const auto on_it = stroke([&](double t) {
    const double x = 0.04 * (t - 0.5);
    return f.world_point(a->fit->frame, 0.002 + x, 0.001 + m * x);
  });
  const Document after = must(before, profile({curve(on_it, "a")})).document;
  const DualPtr b = after.find_dual("a");
  for (std::size_t i = 0; i < a->points.size(); ++i) {
    EXPECT_LE((b->points[i].position() - a->points[i].position()).norm(), 1e-12);
    const Vec3 local = a->fit->frame.to_local(a->points[i].position());
    EXPECT_NEAR(b->fit->surface.value(local.x(), local.y()), f.value(local.x(), local.y()), 1e-12);
  }
}

TEST(ModifyProfile, A9_AStaleFitIsRefittedFirstInTheFrozenFrame) {
  const Document base = fitted("a", random_points(200, 4));
  // New points off the surface: the fit is stale, its frame is not taken anew.
  std::vector<v1::Point> off;
  for (int i = 0; i < 40; ++i) off.push_back(point(-0.03 + 0.001 * i, 0.02, 0.03, 0.9));
  const Document stale = applied(base, {add("a", off)});
  ASSERT_TRUE(stale.find_dual("a")->stale);
  const Document after = must(stale, profile({curve(arch(0.03), "a")})).document;
  const DualPtr b = after.find_dual("a");
  EXPECT_FALSE(b->stale);
  EXPECT_EQ(b->fit->frame.rotation, base.find_dual("a")->fit->frame.rotation);
  EXPECT_EQ(b->fit->residuals_m.size(), 240U);
  EXPECT_LE(refit_error(*b), 1e-9);
  // Just the same as fitting by hand before.
  EXPECT_EQ(document_hash(must(applied(stale, {fit("a")}), profile({curve(arch(0.03), "a")})).document),
            document_hash(after));
}

TEST(ModifyProfile, A9_PushThenProfileThenRefit) {
  v1::Operation push;
  push.mutable_push_points()->add_entities("a");
  push.mutable_push_points()->set_range(0.5);
  for (const double z : {0.05, 0.002}) {
    auto& pose = *push.mutable_push_points()->add_path();
    pose.mutable_centre()->set_x(0.01);
    pose.mutable_centre()->set_z(z);
    pose.mutable_normal()->set_z(-1);
    pose.set_radius_m(0.015);
  }
  for (std::uint32_t degree = 1; degree <= 4; ++degree) {
    const Document base = fitted("a", random_points(300, 50 + degree), degree);
    const Document pushed = applied(base, {push});
    ASSERT_TRUE(pushed.find_dual("a")->stale);
    const Document after = must(pushed, profile({curve(arch(0.03), "a")})).document;
    const DualPtr b = after.find_dual("a");
    EXPECT_LE(refit_error(*b), 1e-9) << degree;
    EXPECT_EQ(b->fit->frame.rotation, base.find_dual("a")->fit->frame.rotation);
    // Negative control: the residuals of the fit before the push would leave the points off their surface.
    const DualPtr stale = pushed.find_dual("a");
    EXPECT_GT(refit_error(*stale), 1e-4) << degree;
  }
}

TEST(ModifyProfile, A7_ALoweredDegreeStaysTheSpace) {
  // Seven points carry degree 2 at most, though 4 was asked for.
  const Document before = fitted("a", random_points(7, 5), 4);
  ASSERT_EQ(before.find_dual("a")->fit->surface.degree(), 2);
  const ApplyResult result = must(before, profile({curve(arch(0.02), "a")}));
  const DualPtr b = result.document.find_dual("a");
  EXPECT_EQ(b->fit->surface.degree(), 2);
  EXPECT_EQ(b->fit->requested_degree, 4U);
  EXPECT_LE(refit_error(*b), 1e-9);
  ASSERT_EQ(result.notes.size(), 1U);
  EXPECT_NE(result.notes[0].find("degree 2"), std::string::npos) << result.notes[0];
}

TEST(ModifyProfile, A10_ADriftedNormalIsNoted) {
  const Document before = fitted("a", random_points(200, 6), 1);
  const auto steep = stroke([](double t) { return Vec3(-0.04 + 0.08 * t, 0, 0.01 + 0.06 * t); });
  Document after = before;
  ApplyResult result = must(after, profile({curve(steep, "a")}));
  ASSERT_EQ(result.notes.size(), 1U);
  EXPECT_NE(result.notes[0].find("refit_plane"), std::string::npos);
  EXPECT_GT(result.document.find_dual("a")->fit->frame_drift_rad, 0.35);
  EXPECT_TRUE(must(before, profile({curve(arch(0.001), "a")})).notes.empty());
}

TEST(ModifyProfile, A20_KeepsTheCurveAsATenthOfThePoints) {
  for (std::uint32_t degree = 1; degree <= 4; ++degree) {
    const Document before = fitted("a", random_points(100, 7 + degree), degree);
    const auto operation = profile({curve(arch(0.03), "a"), curve(arch(0.02, 0.02), "a")}, true);
    const DualPtr b = must(before, operation).document.find_dual("a");
    ASSERT_EQ(b->points.size(), 110U);
    double mean = 0;
    for (const DualPoint& p : before.find_dual("a")->points) mean += p.pressure / 100;
    EXPECT_EQ(b->stroke_count, 3U);
    for (std::size_t i = 100; i < 110; ++i) {
      EXPECT_NEAR(b->points[i].pressure, mean, 1e-15);
      EXPECT_NEAR(height_over(*b, b->points[i].position()), 0, 1e-15);
      EXPECT_EQ(b->points[i].time_ns, 59000);
      EXPECT_GE(b->points[i].stroke, 2U);
    }
    EXPECT_FALSE(b->stale);
    EXPECT_EQ(b->fit->residuals_m.size(), 110U);
    EXPECT_EQ(b->fit->statistics.count, 110U);
    EXPECT_LE(refit_error(*b), 1e-9);
    // The surface is that of the edit without keeping.
    const auto temporary = profile({curve(arch(0.03), "a"), curve(arch(0.02, 0.02), "a")});
    EXPECT_EQ(must(before, temporary).document.find_dual("a")->fit->surface, b->fit->surface);
  }
}

TEST(ModifyProfile, ADegreeChosenForThePointsBeforeIsNotTakenAsChosen) {
  auto automatic = fit("a");
  automatic.mutable_fit()->set_automatic_degree(true);
  const Document before = applied({}, {create("a"), add("a", random_points(80, 44)), automatic});
  ASSERT_EQ(before.find_dual("a")->fit->cross_validated_rms_m.size(), 6U);
  const Document after = must(before, profile({curve(arch(0.02), "a")})).document;
  EXPECT_TRUE(after.find_dual("a")->fit->cross_validated_rms_m.empty());
  EXPECT_EQ(must(after, automatic).document.find_dual("a")->fit->cross_validated_rms_m.size(), 6U);
}

TEST(ModifyProfile, EveryFieldIsChecked) {
  const Document document = applied(two_tiles(), {create("bare"), add("bare", saddle_points())});
  const auto good = line({-0.08, 0, 0.03}, {0.08, 0, 0.03});
  const auto refused = [&](const v1::Operation& operation, ErrorCode code, const std::string& field) {
    expect_refused(document, operation, code, "modify_profile." + field);
  };
  refused(profile({}), ErrorCode::invalid_argument, "curves");
  refused(profile(std::vector<v1::ProfileCurve>(65, curve(good))), ErrorCode::resource_exhausted, "curves");
  refused(profile({curve({})}), ErrorCode::invalid_argument, "curves[0].points");
  refused(profile({curve(good), curve({point(0, 0, 0)})}), ErrorCode::invalid_argument, "curves[1].points");
  refused(profile({curve({point(0, 0, 0), point(0, 0, 0)})}), ErrorCode::invalid_argument,
          "curves[0].points");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refused(profile({curve({point(0, 0, 0), point(0, nan, 0)})}), ErrorCode::invalid_argument,
          "curves[0].points[1].position.y");
  refused(profile({curve({point(0, 0, 0), point(0, 1, 0, 2)})}), ErrorCode::invalid_argument,
          "curves[0].points[1].pressure");
  refused(profile({curve(good, "nobody")}), ErrorCode::not_found, "curves[0].entity");
  refused(profile({curve(good, "bare")}), ErrorCode::failed_precondition, "curves[0].entity");

  auto both = curve(good, "left");
  both.add_split_entities("left");
  refused(profile({both}), ErrorCode::invalid_argument, "curves[0].entity");
  const auto divided = [&](const std::vector<double>& at, const std::vector<std::string>& entities) {
    auto one = curve(good);
    for (const double f : at) one.add_split_at(f);
    for (const auto& id : entities) one.add_split_entities(id);
    return profile({one});
  };
  refused(divided({0.5}, {}), ErrorCode::invalid_argument, "curves[0].split_entities");
  refused(divided({0.5}, {"left"}), ErrorCode::invalid_argument, "curves[0].split_entities");
  refused(divided({0.5, 0.4}, {"left", "", "right"}), ErrorCode::invalid_argument, "curves[0].split_at[1]");
  refused(divided({1.1}, {"left", "right"}), ErrorCode::invalid_argument, "curves[0].split_at[0]");
  refused(divided({nan}, {"left", "right"}), ErrorCode::invalid_argument, "curves[0].split_at[0]");
  refused(divided({0.5}, {"left", "no"}), ErrorCode::not_found, "curves[0].split_entities[1]");
  refused(divided({0.5}, {"bare", "left"}), ErrorCode::failed_precondition, "curves[0].split_entities[0]");
  EXPECT_EQ(must(document, divided({0.0, 1.0}, {"left", "right", "left"})).changes.changed,
            (std::vector<std::string>{"right"}));  // What is left over at the ends is no curve.

  auto among = profile({curve(good)});
  among.mutable_modify_profile()->add_entities("left");
  among.mutable_modify_profile()->add_entities("bare");
  refused(among, ErrorCode::failed_precondition, "entities[1]");
  among.mutable_modify_profile()->set_entities(1, "no");
  refused(among, ErrorCode::not_found, "entities[1]");

  expect_refused(applied({}, {create("bare")}), profile({curve(good)}), ErrorCode::failed_precondition,
                 "modify_profile.entities");

  // Curves at the rim of the workspace, named for a shape explicitly, never leave a number that is not one.
  const auto far = apply(document, profile({curve(line({-9999, 0, 9999}, {9999, 9999, -9999}), "left")}));
  if (!far.ok()) {
    EXPECT_EQ(far.error().field, "modify_profile.curves");
  } else {
    for (const DualPoint& p : far->document.find_dual("left")->points) {
      EXPECT_TRUE(p.position().allFinite());
    }
  }
  ApplyContext tight;
  tight.limits.max_points_per_operation = 100;
  expect_refused(document, profile({curve(good), curve(good)}), ErrorCode::resource_exhausted,
                 "modify_profile.curves[1].points", tight);
  tight.limits.max_points_per_operation = 1000;
  tight.limits.max_points_per_shape = 80;
  expect_refused(document, profile({curve(good, "left")}, true), ErrorCode::resource_exhausted,
                 "modify_profile.curves", tight);
}

TEST(ModifyProfile, A28_UndoIsBitIdentical_AndAGestureInTheAirLeavesTheBaseAlone) {
  Model model(two_tiles());
  const std::string start = document_hash(model.document());
  const auto across = line({-0.08, 0, 0.03}, {0.08, 0.005, 0.03});
  const auto id = model.begin_provisional(profile({curve({across[0], across[1]})}));
  ASSERT_TRUE(id.ok());
  for (std::size_t n = 3; n <= across.size(); ++n) {
    const std::vector<v1::Point> so_far(across.begin(), across.begin() + static_cast<std::ptrdiff_t>(n));
    ASSERT_TRUE(model.update_provisional(*id, profile({curve(so_far)})).ok());
    EXPECT_EQ(document_hash(model.document()), start);
  }
  EXPECT_TRUE(model.is_provisional("right"));
  const std::string shown = document_hash(model.preview());
  ASSERT_TRUE(model.commit_provisional(*id).ok());
  EXPECT_EQ(document_hash(model.document()), shown);
  ASSERT_TRUE(model.submit(undo()).ok());
  EXPECT_EQ(document_hash(model.document()), start);
  ASSERT_TRUE(model.submit(redo()).ok());
  EXPECT_EQ(document_hash(model.document()), shown);
}

}  // namespace
}  // namespace handloft::model::test
