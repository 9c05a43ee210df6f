#include "server-model/geometry/fuzzy_point.h"

#include <algorithm>
#include <cstddef>

namespace handloft::geometry {
namespace {

double clamp_rho(double rho) {
  return rho > 0 ? std::min(rho, 1.0) : 0.0;
}  // NaN compares false.

}  // namespace

double fuzzy_radius(double rho, const FuzzyPointOptions& options) {
  return std::max(options.length_m * (1 - clamp_rho(rho)), options.length_m * options.min_radius_fraction);
}

double fuzzy_opacity(double r, double rho, const FuzzyPointOptions& options) {
  const double radius = fuzzy_radius(rho, options);
  if (!(r < radius)) return 0;
  return std::clamp(clamp_rho(rho) * (1 - std::max(r, 0.0) / radius), 0.0, 1.0);
}

std::array<FuzzyShell, fuzzy_shell_count> fuzzy_shells(double rho, const FuzzyPointOptions& options) {
  // Looking through the centre one has passed k shells, outermost first, and should see T_k = T(r_mid,k):
  // each shell's alpha turns T_{k-1} into T_k by 'over': T_k = T_{k-1} + (1 - T_{k-1}) a_k.
  const double radius = fuzzy_radius(rho, options);
  std::array<FuzzyShell, fuzzy_shell_count> shells;
  double before = 0;
  for (std::size_t k = 0; k < shells.size(); ++k) {
    const double outer = static_cast<double>(shells.size() - k) / fuzzy_shell_count;
    const double middle = outer - 0.5 / fuzzy_shell_count;
    const double target = clamp_rho(rho) * (1 - middle);
    shells[k] = {radius * outer, (target - before) / (1 - before)};
    before = target;
  }
  return shells;
}

}  // namespace handloft::geometry
