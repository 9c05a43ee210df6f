// A15-A17: falloff, range and propagation of a push.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <thread>
#include <vector>

#include "server-model/geometry/propagation.h"
#include "server-model/geometry/push_solver.h"

namespace handloft::geometry {
namespace {

TEST(Propagation, A15_Falloff) {
  EXPECT_NEAR(falloff_beta, 0.135335, 1e-6);
  EXPECT_EQ(falloff_beta, std::exp(-2.0));
  EXPECT_EQ(falloff(0), 1);
  EXPECT_NEAR(falloff(0.5), 0.544946, 1e-6);
  EXPECT_EQ(falloff(1), 0);
  EXPECT_EQ(falloff(1.5), 0);
  EXPECT_NEAR(falloff(1 - 1e-6) / 1e-6, 0.626, 1e-3);  // The slope at the rim.
}

std::vector<Vec3> dome(std::size_t n, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Vec3> points(n);
  for (Vec3& p : points) {
    const double x = 0.1 * unit(random), y = 0.08 * unit(random);
    p = {x, y, 0.05 - x * x - 2 * y * y + 0.002 * unit(random)};
  }
  return points;
}

// A motion that dives into the dome, slides and turns.
std::vector<DiskPose> gesture(int per_piece) {
  const std::vector<DiskPose> keys = {{{0.02, 0, 0.08}, Vec3(0, 0, -1), 0.015},
                                      {{0.02, 0.01, 0.045}, Vec3(0.1, 0, -1).normalized(), 0.02},
                                      {{0.0, 0.02, 0.035}, Vec3(0.1, 0, -1).normalized(), 0.02},
                                      {{-0.02, 0.02, 0.04}, Vec3(0.1, 0, -1).normalized(), 0.03}};
  std::vector<DiskPose> poses{keys[0]};
  for (std::size_t i = 1; i < keys.size(); ++i) {
    const DiskPose &a = keys[i - 1], &b = keys[i];
    const double angle = std::acos(std::clamp(a.normal.dot(b.normal), -1.0, 1.0));
    for (int k = 1; k <= per_piece; ++k) {
      const double t = static_cast<double>(k) / per_piece;
      const Vec3 normal = angle < 1e-9
                              ? b.normal
                              : Vec3((std::sin((1 - t) * angle) * a.normal + std::sin(t * angle) * b.normal) /
                                     std::sin(angle));
      poses.push_back({(1 - t) * a.centre + t * b.centre, normal, (1 - t) * a.radius_m + t * b.radius_m});
    }
  }
  return poses;
}

PushSolver solver_after(const std::vector<Vec3>& rest, const std::vector<DiskPose>& poses) {
  auto solver = PushSolver::create(rest);
  EXPECT_TRUE(solver);
  for (const DiskPose& pose : poses) EXPECT_TRUE(solver->move_disk(pose));
  return std::move(*solver);
}

double largest(const std::vector<Vec3>& v) {
  double result = 0;
  for (const Vec3& x : v) result = std::max(result, x.norm());
  return result;
}

double largest_difference(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) worst = std::max(worst, (a[i] - b[i]).norm());
  return worst;
}

// Two points are pushed by 10 and 20 mm, the third stands 30 and 40 mm from them, so d_max = 50 mm - between
// the far contact and it, and 40 mm is the distance of the near ones.
struct ThreePoints {
  std::vector<Vec3> rest = {{0, 0, 0}, {0.01, 0, 0}, {0.04, 0, 0}};
  std::vector<Contact> contacts = {{0, {0, 0, -0.01}}, {1, {0, 0, -0.02}}};
  double d_max = 0.04;
};

TEST(Propagation, A17_ThreePointsByHand) {
  const ThreePoints three;
  const auto solver = PushSolver::create(three.rest);
  ASSERT_TRUE(solver);
  EXPECT_EQ(std::sqrt(solver->squared_reach_m2(three.contacts)), three.d_max);
  // Range 1: the first is exactly at the range and has no influence; the second at x = 3/4.
  const double eta = (std::exp(-2 * 0.5625) - std::exp(-2.0)) / (1 - std::exp(-2.0));
  for (const Falloff falloff : {Falloff::literal, Falloff::smooth}) {
    const auto v = solver->displacements(three.contacts, 1, falloff);
    EXPECT_NEAR(v[2].z(), -0.02 * eta, 1e-15);
    EXPECT_EQ(v[2].x(), 0);
    // The first gets eta(1/4) 20 mm > 10 mm from the second, and the second keeps its own push.
    const double near = (std::exp(-2 * 0.0625) - std::exp(-2.0)) / (1 - std::exp(-2.0));
    EXPECT_NEAR(v[0].z(), -0.02 * near, 1e-15);
    EXPECT_EQ(v[1], Vec3(0, 0, -0.02));
  }
}

TEST(Propagation, A17_TwoContactsInRangeByHand) {
  // Four points on a line; the last one makes d_max, the third is reached by both contacts.
  const std::vector<Vec3> rest = {{0, 0, 0}, {0.01, 0, 0}, {0.02, 0, 0}, {0.05, 0, 0}};
  const std::vector<Contact> contacts = {{0, {0, 0, -0.01}}, {1, {0, 0.02, 0}}};
  const auto solver = PushSolver::create(rest);
  ASSERT_TRUE(solver);
  const auto eta = [](double x) { return (std::exp(-2 * x * x) - std::exp(-2.0)) / (1 - std::exp(-2.0)); };
  const double far = eta(0.4), near = eta(0.2);
  const auto literal = solver->displacements(contacts, 1, Falloff::literal);
  EXPECT_NEAR(literal[2].z(), -0.01 * far / 2, 1e-15);
  EXPECT_NEAR(literal[2].y(), 0.02 * near / 2, 1e-15);
  const auto smooth = solver->displacements(contacts, 1, Falloff::smooth);
  EXPECT_NEAR(smooth[2].z(), -0.01 * far * far / (far + near), 1e-15);
  EXPECT_NEAR(smooth[2].y(), 0.02 * near * near / (far + near), 1e-15);
  EXPECT_EQ(literal[3].z(), 0);  // At d_max of the first: eta = 0 exactly, and m = 1.
  EXPECT_NEAR(literal[3].y(), 0.02 * eta(0.8), 1e-15);
}

TEST(Propagation, A16_FractionZeroMovesOnlyTheContacts) {
  const auto rest = dome(2000, 1);
  const PushSolver solver = solver_after(rest, gesture(3));
  const auto v = solver.displacements(0, Falloff::literal);
  const auto contacts = solver.contacts();
  ASSERT_GT(contacts.size(), 20U);
  EXPECT_EQ(
      static_cast<std::size_t>(std::count_if(v.begin(), v.end(), [](const Vec3& x) { return !x.isZero(0); })),
      contacts.size());
  for (const Contact& c : contacts) EXPECT_EQ(v[c.index], c.displacement);
}

TEST(Propagation, A16_FractionOneLeavesTheFarthestPointExactlyAtRest) {
  // One contact, so that the farthest point has no other influence.
  auto rest = dome(20000, 2);
  rest.push_back({0, 0, 0.2});
  const auto solver = PushSolver::create(rest);
  const std::vector<Contact> contacts = {{20000, {0, 0, -0.01}}};
  const auto farthest = std::max_element(rest.begin(), rest.end(), [&](const Vec3& a, const Vec3& b) {
    return squared_distance(a, rest.back()) < squared_distance(b, rest.back());
  });
  const auto v = solver->displacements(contacts, 1, Falloff::literal);
  EXPECT_EQ(v[static_cast<std::size_t>(farthest - rest.begin())], Vec3(0, 0, 0));
  EXPECT_EQ(std::count(v.begin(), v.end(), Vec3(0, 0, 0)), 1);
}

TEST(Propagation, A16_LargestDistanceIsThatOfAllPairs) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    const auto rest = dome(3000, seed);
    const PushSolver solver = solver_after(rest, gesture(1));
    const auto contacts = solver.contacts();
    std::vector<bool> is_contact(rest.size());
    for (const Contact& c : contacts) is_contact[c.index] = true;
    double best = 0;
    for (const Contact& c : contacts) {
      for (std::size_t j = 0; j < rest.size(); ++j) {
        if (!is_contact[j]) best = std::max(best, squared_distance(rest[c.index], rest[j]));
      }
    }
    EXPECT_EQ(solver.squared_reach_m2(contacts), best);
  }
}

TEST(Propagation, A16_WithoutOthersThereIsNoPropagation) {
  const std::vector<Vec3> rest = {{0, 0, 0}, {0.001, 0, 0}};
  const PushSolver solver =
      solver_after(rest, {{{0, 0, 0.01}, {0, 0, -1}, 0.02}, {{0, 0, -0.01}, {0, 0, -1}, 0.02}});
  EXPECT_EQ(solver.squared_reach_m2(solver.contacts()), 0);
  for (const Vec3& v : solver.displacements(1, Falloff::smooth)) EXPECT_NEAR(v.z(), -0.01, 1e-15);
}

TEST(Propagation, A17_SameGestureAt30And90PosesASecond) {
  const auto rest = dome(4000, 5);
  const PushSolver slow = solver_after(rest, gesture(5)), fast = solver_after(rest, gesture(15));
  for (const Falloff falloff : {Falloff::literal, Falloff::smooth}) {
    for (const double range : {0.0, 0.3, 1.0}) {
      const auto a = slow.displacements(range, falloff), b = fast.displacements(range, falloff);
      EXPECT_GT(largest(a), 0.005);
      EXPECT_LT(largest_difference(a, b), 1e-9);
    }
  }
}

TEST(Propagation, A17_TurningThePotentiometerBackGivesWhatWas) {
  const auto rest = dome(4000, 6);
  const PushSolver solver = solver_after(rest, gesture(4));
  const auto before = solver.displacements(0.4, Falloff::literal);
  EXPECT_NE(solver.displacements(0.7, Falloff::literal), before);
  EXPECT_EQ(solver.displacements(0.4, Falloff::literal), before);
}

TEST(Propagation, A17_SmoothVariantHasNoJumpWhereAContactEntersTheRange) {
  // One contact at 10 mm and one whose range begins just before or behind the point.
  const std::vector<Vec3> rest = {{0, 0, 0}, {0.03, 0, 0}, {0.01, 0, 0}};
  const std::vector<Contact> contacts = {{0, {0, 0, -0.01}}, {1, {0, 0, -0.01}}};
  const auto at = [&](double range, Falloff falloff) {
    return propagate_all_pairs(rest, contacts, range * range, falloff)[2].z();
  };
  const double before = 0.02 - 1e-9, behind = 0.02 + 1e-9;
  EXPECT_LT(std::abs(at(before, Falloff::smooth) - at(behind, Falloff::smooth)), 1e-8);
  EXPECT_GT(std::abs(at(before, Falloff::literal) - at(behind, Falloff::literal)),
            2e-3);  // The defect of eq. 5.
}

TEST(Propagation, A17_FastWayKeepsItsErrorBound) {
  const auto rest = dome(8000, 7);
  const PushSolver solver = solver_after(rest, gesture(2));
  const auto contacts = solver.contacts();
  ASSERT_GT(contacts.size() * rest.size(), all_pairs_limit);
  double push = 0;
  for (const Contact& c : contacts) push = std::max(push, c.displacement.norm());
  const double d_max_squared = solver.squared_reach_m2(contacts);
  const PointTree tree(rest, propagation_leaf_size);
  for (const Falloff falloff : {Falloff::literal, Falloff::smooth}) {
    for (const double range : {0.02, 0.3, 0.7, 1.0}) {
      const double square = range * range * d_max_squared;
      EXPECT_LT(largest_difference(propagate(tree, contacts, square, falloff),
                                   propagate_all_pairs(rest, contacts, square, falloff)),
                propagation_error_bound * push)
          << range;
    }
  }
}

// The hardest case for grids: all contacts of a point stand together, so far away that eta is small and the
// smooth falloff divides by little, and push in opposite directions.
TEST(Propagation, A17_FastWayKeepsItsErrorBoundNearTheEndOfTheRange) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> unit(-1, 1);
  const double range = 0.1;
  std::vector<Vec3> rest;
  std::vector<Contact> contacts;
  for (std::uint32_t i = 0; i < 400; ++i) {
    rest.emplace_back(0.01 * unit(random), 0.01 * unit(random), 0.01 * unit(random));
    contacts.push_back({i, Vec3(i % 2 == 0 ? 0.05 : -0.05, 0.02 * unit(random), 0)});
  }
  for (int i = 0; i < 12000; ++i) {
    const Vec3 direction = Vec3(1, 0.3 * unit(random), 0.3 * unit(random)).normalized();
    rest.push_back(range * (0.94 + 0.06 * unit(random)) * direction);
  }
  const PointTree tree(rest, propagation_leaf_size);
  for (const Falloff falloff : {Falloff::literal, Falloff::smooth}) {
    const double difference = largest_difference(propagate(tree, contacts, range * range, falloff),
                                                 propagate_all_pairs(rest, contacts, range * range, falloff));
    EXPECT_GT(difference, 0);  // It was the fast way.
    EXPECT_LT(difference, propagation_error_bound * 0.05);
  }
}

TEST(Propagation, ResultDoesNotDependOnWhoRunsTheTasks) {
  const auto rest = dome(8000, 8);
  const PushSolver solver = solver_after(rest, gesture(2));
  const auto backwards = [](std::size_t count, const std::function<void(std::size_t)>& task) {
    std::thread odd([&] {
      for (std::size_t i = 1; i < count; i += 2) task(i);
    });
    for (std::size_t i = (count + 1) / 2; i-- > 0;) task(2 * i);
    odd.join();
  };
  for (const Falloff falloff : {Falloff::literal, Falloff::smooth}) {
    EXPECT_EQ(solver.displacements(0.5, falloff), solver.displacements(0.5, falloff, backwards));
  }
}

TEST(Propagation, CoincidentPointsAndAHugeRangeAreFinite) {
  std::vector<Vec3> rest(5000, Vec3(0.1, 0.2, 0.3));
  rest.push_back({0.1, 0.2, 0.4});
  const auto solver = PushSolver::create(rest);
  std::vector<Contact> contacts;
  for (std::uint32_t i = 0; i < 100; ++i) contacts.push_back({i, {0, 0, -0.01}});
  for (const Falloff falloff : {Falloff::literal, Falloff::smooth}) {
    for (const Vec3& v : solver->displacements(contacts, 1, falloff)) ASSERT_TRUE(v.allFinite());
  }
}

// Of a contact's own share, 1, the fast way has an error; the mean of what is left beside it must not divide
// by the little that a neighbour at the rim of the range counts.
TEST(Propagation, A17_AContactWithNeighboursAtTheRimAloneIsExactToo) {
  constexpr double range = 0.01;
  std::mt19937_64 random(20261123);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Vec3> rest;
  std::vector<Contact> contacts;
  for (int pair = 0; pair < 40; ++pair) {
    const Vec3 first(3 * range * pair, 0, 0);
    const double inside = std::pow(10.0, -1.0 - 0.2 * pair);  // Of the range: a tenth to a billionth.
    for (const Vec3& p : {first, Vec3(first + Vec3(0, (1 - inside) * range, 0))}) {
      contacts.push_back({static_cast<std::uint32_t>(rest.size()),
                          0.5 * Vec3(unit(random), unit(random), unit(random)).normalized()});
      rest.push_back(p);
    }
  }
  for (int i = 0; i < 2000; ++i) rest.emplace_back(1.2 * std::abs(unit(random)), 0.02 * unit(random), 0);
  ASSERT_GT(rest.size() * contacts.size(), all_pairs_limit);
  for (const Falloff falloff : {Falloff::literal, Falloff::smooth}) {
    const auto exact = propagate_all_pairs(rest, contacts, range * range, falloff);
    const auto fast = propagate(PointTree(rest, propagation_leaf_size), contacts, range * range, falloff);
    for (std::size_t i = 0; i < rest.size(); ++i)
      ASSERT_LE((fast[i] - exact[i]).norm(), 0.5 * propagation_error_bound) << i;
  }
}

}  // namespace
}  // namespace handloft::geometry
