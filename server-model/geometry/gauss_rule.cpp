#include "server-model/geometry/gauss_rule.h"

#include <cmath>
#include <cstddef>
#include <numbers>

namespace handloft::geometry {

// Gauss-Legendre by Newton's method on the three-term recurrence, started at Tricomi's estimate.
GaussRule gauss_rule(int count) {
  GaussRule rule;
  rule.node.resize(static_cast<std::size_t>(count));
  rule.weight.resize(static_cast<std::size_t>(count));
  constexpr int newton_steps = 8;  // Far more than the four that doubles need.
  for (int i = 0; i < (count + 1) / 2; ++i) {
    double x = std::cos(std::numbers::pi * (i + 0.75) / (count + 0.5));
    double slope = 1;
    for (int step = 0; step < newton_steps; ++step) {
      double previous = 1;
      double value = x;
      for (int k = 2; k <= count; ++k) {
        const double next = ((2 * k - 1) * x * value - (k - 1) * previous) / k;
        previous = value;
        value = next;
      }
      slope = count * (x * value - previous) / (x * x - 1);
      x -= value / slope;
    }
    if (2 * i + 1 == count) x = 0;
    const double weight = 2 / ((1 - x * x) * slope * slope);
    const auto low = static_cast<std::size_t>(i);
    const auto high = static_cast<std::size_t>(count - 1 - i);
    rule.node[low] = -x;
    rule.node[high] = x;
    rule.weight[low] = rule.weight[high] = weight;
  }
  return rule;
}

}  // namespace handloft::geometry
