#pragma once
// The falloff of a push with the distance (A15, eq. 4):  eta(x) = (exp(-x^2 / sigma^2) - beta) / (1 - beta),
// beta = exp(-1 / sigma^2), x = d / d_range, sigma = 1/sqrt(2); 0 from x = 1 on. eta(0) = 1,
// eta(0.5) = 0.5449, eta(1) = 0; its slope at 1 is -0.626, so it is only continuous there.

#include <cmath>

namespace handloft::geometry {

inline constexpr double falloff_rate = 2.0;                     ///< 1 / sigma^2
inline constexpr double falloff_beta = 0.13533528323661269189;  ///< exp(-2)

/// eta as a function of x^2.
inline double falloff_of_square(double x_squared) {
  if (!(x_squared < 1)) return 0;
  return (std::exp(-falloff_rate * x_squared) - falloff_beta) / (1 - falloff_beta);
}
inline double falloff(double x) {
  return falloff_of_square(x * x);
}

/// How the contacts in range are averaged at a point (A17).
enum class Falloff : unsigned char {
  literal,  ///< eq. 5:  v_j = (1/m) sum_i eta_ij v_i  over the m contacts i with d_ij < d_range.
  smooth,   ///< v_j = sum_i eta_ij^2 v_i / sum_i eta_ij: the same for m = 1, without a jump where one enters.
};

}  // namespace handloft::geometry
