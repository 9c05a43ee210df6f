#pragma once
// A tour of everything that a hand can do (A25): it lays the points of a lid, fits, presses a dent with the
// closed hand, with the smooth falloff, while it turns the potentiometer, takes that back and does it again,
// raises the lid along a line with a pointing finger, trims it inside a loop, and keeps a second alternative
// of another degree. What tests measure against is stated here; lengths in metres.

#include <Eigen/Core>

#include "daemon-tracking/source/simulated/hand_program.h"

namespace handloft::tracking::tour {

/// Half the sides of the rectangle over which the lid is laid.
inline constexpr double half_width_m = 0.040, half_length_m = 0.048;

/// The lid as it is laid: z at (x, y).
constexpr double lid_height_m(double x_m, double y_m) {
  return 0.105 - 2.5 * x_m * x_m - 2.0 * y_m * y_m;
}

/// The dent: where the closed hand's centroid comes down to, and the potentiometer then.
inline constexpr double dent_x_m = 0.018, dent_y_m = 0.014, dent_z_m = 0.090;
inline constexpr double dent_pressure = 0.25;  ///< Of the disk's radius: 5 mm + 0.25 * 55 mm (A13).
inline constexpr double dent_range = 0.2;      ///< Of the largest distance (A16).

/// The profile stroke: along y over the middle, this high above the lid as it was laid.
inline constexpr double ridge_m = 0.012;
Eigen::Vector3d ridge(double u);  ///< 0..1

/// A second profile, over the left half of the lid; over the middle the thumb taps, and from there on, far
/// above the right half, it is nobody's (A21).
inline constexpr double flank_m = 0.006, flank_end_m = 0.045;
inline constexpr double flank_tap = 0.5;  ///< Of its way.
Eigen::Vector3d flank(double u);          ///< 0..1

/// The trimming curve: an ellipse about the middle, drawn above the lid, once around.
inline constexpr double loop_half_width_m = 0.026, loop_half_length_m = 0.034;
Eigen::Vector3d loop(double u);  ///< 0..1

struct Options {
  HandOptions hand;
  int strokes = 7;  ///< Of the lid, along y.
  double stroke_s = 0.6;
};

}  // namespace handloft::tracking::tour

namespace handloft::tracking {

/// Strokes, "Fit", "Points + surface", "Falloff" on the second page, a push, "Undo", "Redo", a profile, one
/// that the thumb divides, "Profile / boundary", a boundary, "Profile / boundary", "New alternative",
/// "Degree", "Next alternative", and withdraws. About a minute.
HandProgram tour_program(const tour::Options& options = {});

}  // namespace handloft::tracking
