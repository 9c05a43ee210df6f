#pragma once
// Sculpting by hand (D18, D19): the simulated hand makes a flat sheet, taps icons onto it, drags one with its
// fist, turns another, makes a load of a third and softens it, lets one go, and commits; then it presses the
// sheet down once more and recovers it. What tests measure against is stated here; lengths in metres.

#include <Eigen/Geometry>

#include "daemon-tracking/source/simulated/hand_program.h"

namespace handloft::tracking::sculpt {

/// The sheet that "Sculpt" makes on an empty table: its middle is above the table's (SheetOptions of the
/// server's interaction).
inline constexpr double sheet_z_m = 0.1;

/// The places where the hand taps icons, in the order in which it does.
inline constexpr double anchor_x_m = 0.11, anchor_y_m = 0.07;   ///< Four held positions, one in each quarter.
inline const Eigen::Vector3d lifted_m(-0.05, 0.0, sheet_z_m);   ///< Dragged.
inline const Eigen::Vector3d turned_m(0.06, 0.0, sheet_z_m);    ///< Made to hold the tangent along x.
inline const Eigen::Vector3d loaded_m(0.005, 0.06, sheet_z_m);  ///< Made a load.
inline const Eigen::Vector3d pressed_m(0.0, -0.06, sheet_z_m);  ///< Tapped after the commit.

inline const Eigen::Vector3d lift_m(0.012, 0.008, 0.03);  ///< By which the fist goes with the first,
inline constexpr double turn_rad = 0.35;                  ///< turns with the second, about y,
inline const Eigen::Vector3d load_m(0.0, 0.0, 0.02);      ///< goes with the load, which is soft,
/// and, when the first is passive, with nothing at all.
inline const Eigen::Vector3d in_vain_m(0.0, 0.0, 0.03);
inline const Eigen::Vector3d press_m(0.0, 0.0, -0.02);  ///< With the last, before "Recover".

struct Options {
  HandOptions hand;
  double tap_s = 0.4;  ///< How long a pointing hand stays for a tap.
  double drag_s = 1.2;
};

}  // namespace handloft::tracking::sculpt

namespace handloft::tracking {

/// "Sculpt", six taps with a drag and a turn between, "Icon property", a tap, "Hold / load", "Load
/// stiffness", a drag, "Icon state" and a fist that takes nothing, "Commit"; a tap, a drag, "Recover". About
/// three quarters of a minute.
HandProgram sculpt_program(const sculpt::Options& options = {});

}  // namespace handloft::tracking
