#pragma once
// How an uncertain point looks (A2, eq. 1; A3): a fuzzy ball, small and opaque where pressed hard, large and
// faint where hardly touched. R(rho) = L (1 - rho);  T(r, rho) = rho (1 - r / R(rho)). T is called
// transparency in the paper but is opacity. Drawn as five nested spheres, whose alphas are agreed here for
// every client.

#include <array>

namespace handloft::geometry {

struct FuzzyPointOptions {
  double length_m = 0.0127;  ///< L: half an inch, as in all of the paper's examples.
  double min_radius_fraction =
      0.02;  ///< R_min / L: eq. 1 makes the most certain points vanish (R = 0 at rho = 1).
};

inline constexpr int fuzzy_shell_count = 5;

struct FuzzyShell {
  double radius_m = 0;
  double alpha = 0;  ///< For 'over' compositing, outer to inner.
};

/// R = max(L (1 - rho), R_min), metres. rho is clamped to 0..1; NaN counts as 0.
double fuzzy_radius(double rho, const FuzzyPointOptions& options = {});

/// T in 0..1 at distance r (metres, >= 0) from the centre; 0 from R outwards.
double fuzzy_opacity(double r, double rho, const FuzzyPointOptions& options = {});

/// Outermost first: radii R (5, 4, 3, 2, 1)/5 and alphas whose composite is the staircase through T at the
/// middles of the shells; within rho / 10 of the linear T.
std::array<FuzzyShell, fuzzy_shell_count> fuzzy_shells(double rho, const FuzzyPointOptions& options = {});

}  // namespace handloft::geometry
