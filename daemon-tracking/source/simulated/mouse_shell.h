#pragma once
// The shape that the simulated hand designs: the shell of a computer mouse, symmetric about the plane x = 0,
// its long axis along y, floating 6..11 cm above the table. Both surfaces are quadratic polynomials, so that
// a fit of total degree 2 or more must find them again; what end-to-end tests measure against.
//
//   top:   z(x, y) = 0.105 - 0.06 y - 3.3 y^2 - 10 x^2     |x| <= 0.032, |y| <= 0.055   (drawn: -0.004 <= x
//   <= 0.030) side:  x(y, z) = 0.036 - 4 y^2 - 0.25 (z - 0.08)       |y| <= 0.048, 0.066 <= z <= 0.094
//
// (metres; the side's normal points to +x, leaning up by 14 degrees.)

#include <Eigen/Core>

#include "daemon-tracking/source/simulated/hand_program.h"

namespace handloft::tracking::mouse_shell {

inline constexpr double top_half_width_m = 0.032;
inline constexpr double top_half_length_m = 0.055;
inline constexpr double side_half_length_m = 0.048;
inline constexpr double side_bottom_m = 0.066;
inline constexpr double side_top_m = 0.094;

/// Height of the top surface above the table at (x, y).
constexpr double top_height_m(double x_m, double y_m) {
  return 0.105 - 0.06 * y_m - 3.3 * y_m * y_m - 10.0 * x_m * x_m;
}
/// x of the right-hand side surface at (y, z).
constexpr double side_x_m(double y_m, double z_m) {
  return 0.036 - 4.0 * y_m * y_m - 0.25 * (z_m - 0.08);
}

/// Distance of a point from the surface, first order in it (|f| / |grad f|), signed: positive outside.
double top_distance_m(const Eigen::Vector3d& point_m);
double side_distance_m(const Eigen::Vector3d& point_m);

/// Whether the hand touches "Symmetry" once more before it draws the side.
enum class SideSymmetry { leave, toggle };

struct Options {
  HandOptions hand;
  SideSymmetry side_symmetry = SideSymmetry::leave;
  int top_strokes = 7;   ///< Along y; two more run across.
  int side_strokes = 6;  ///< Along y at increasing height.
  double stroke_s = 0.55;
};

}  // namespace handloft::tracking::mouse_shell

namespace handloft::tracking {

/// Idle, "Symmetry", the top's strokes, "Fit", "New shape", the side's strokes, "Fit", "Points / surface"
/// twice, and withdraws, so that the design lies free. About 29 s.
HandProgram mouse_shell_program(const mouse_shell::Options& options = {});

}  // namespace handloft::tracking
