// A16, A17: the fast propagation against all pairs, on random clouds.

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "server-model/geometry/propagation.h"
#include "server-model/geometry/push_solver.h"

namespace handloft::geometry {
namespace {

RC_GTEST_PROP(PushProperty, A17_FastPropagationIsWithinItsBoundOfAllPairs, ()) {
  std::mt19937_64 random(*rc::gen::arbitrary<std::uint64_t>());
  const auto n = static_cast<std::size_t>(*rc::gen::inRange(1500, 5000));
  const auto m = static_cast<std::size_t>(*rc::gen::inRange(12, 400));
  // From a line over a sheet to a block.
  const double flat_y = *rc::gen::element(0.0, 0.01, 1.0), flat_z = *rc::gen::element(0.0, 0.01, 1.0);
  const double range = *rc::gen::element(0.05, 0.2, 0.5, 0.9, 1.0);
  const auto falloff = *rc::gen::element(Falloff::literal, Falloff::smooth);
  const bool patch = *rc::gen::arbitrary<bool>();

  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Vec3> rest(n);
  for (Vec3& p : rest) p = {unit(random), flat_y * unit(random), flat_z * unit(random)};
  std::vector<std::uint32_t> order(n);
  for (std::size_t i = 0; i < n; ++i) order[i] = static_cast<std::uint32_t>(i);
  if (patch) {
    const Vec3 centre = rest[0];
    std::sort(order.begin(), order.end(), [&](auto i, auto j) {
      return squared_distance(rest[i], centre) < squared_distance(rest[j], centre);
    });
  }
  std::vector<Contact> contacts;
  for (std::size_t i = 0; i < m; ++i) {
    contacts.push_back({order[i], 0.5 * Vec3(unit(random), unit(random), unit(random))});
  }
  const auto solver = PushSolver::create(rest);
  RC_ASSERT(solver.ok());
  const double square = range * range * solver->squared_reach_m2(contacts);
  const auto fast = propagate(PointTree(rest, propagation_leaf_size), contacts, square, falloff);
  const auto exact = propagate_all_pairs(rest, contacts, square, falloff);
  double worst = 0, push = 0;
  for (std::size_t i = 0; i < n; ++i) worst = std::max(worst, (fast[i] - exact[i]).norm());
  for (const Contact& c : contacts) push = std::max(push, c.displacement.norm());
  RC_ASSERT(worst <= propagation_error_bound * push);
}

}  // namespace
}  // namespace handloft::geometry
