#pragma once
// What may be tuned about the way from the hand to the model, and the few words that all gestures share.

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "common/base/clock.h"
#include "server-model/geometry/disk.h"
#include "server-model/interaction/drawn_curve.h"
#include "server-model/interaction/fist_hold.h"
#include "server-model/interaction/hand_centre.h"
#include "server-model/interaction/hand_sample.h"
#include "server-model/model/dual_shape.h"

namespace handloft::interaction {

/// What new strokes do (A12). The palette's symmetry cell steps through these in this order: a top surface
/// wants its mirror image in the same set, a side surface a partner on the other side.
enum class StrokeSymmetry { off, same_shape, partner };

/// What a pointing hand draws (A19, A24).
enum class TrimMode { profile, boundary };

/// What a closed or pointing hand does: change a shape's points and surface, or take the whole shape along.
enum class HandTool { sculpt, move };

/// What a pointing hand adds to a sculpted surface: a tap a point and a drawn line a curve, or two corners a
/// region.
enum class IconPen { point_or_curve, region };

/// A 3D mouse moves by rates: its cap's displacement is a velocity.
struct SpaceMouseOptions {
  double speed_m_s = 0.05;  ///< At full displacement: across a hand's breadth in two seconds.
  double turn_rad_s = 0.8;  ///< At full displacement: a right angle in two seconds.
  double dead_zone = 0.05;  ///< Of each axis: its springs do not bring the cap quite back.
  /// The cap at rest this long ends the drag: shorter pauses are of the hand that pushes on.
  Duration pause = std::chrono::milliseconds(300);
  /// A longer gap between two frames moves nothing: nobody knows what the cap did meanwhile.
  Duration longest_step = std::chrono::milliseconds(100);
};

/// A flat sheet to begin with: as large as two hands, above the middle of the table.
struct SheetOptions {
  double width_m = 0.3;
  double depth_m = 0.2;
  Eigen::Vector3d centre_m{0.0, 0.0, 0.1};
};

struct InteractionOptions {
  /// A hand that is lost this long is gone: its gesture is cancelled. Shorter gaps (a hidden finger, a radio
  /// frame) only leave out points.
  Duration grace = std::chrono::milliseconds(250);
  double min_spacing_m = 0.0;    ///< Arc-length thinning (A1); 0: one point a frame, as the paper does.
  std::uint32_t new_degree = 0;  ///< Of shapes made by hand; 0: the model's default (2, A4).
  model::MirrorPlane symmetry_plane{
      Eigen::Vector3d::Zero(),
      Eigen::Vector3d::UnitX()};  ///< x = 0 through the table's origin: the mouse points along y.
  /// A shape farther from the hand than this is not meant: a fist's width, so that two shapes a hand's
  /// breadth apart can be told from each other.
  double reach_m = 0.05;
  geometry::DiskOptions disk;  ///< A13
  /// Of the centre of a fist: its fingertips hide each other for longer, but it turns slowly.
  HandCentreOptions fist{std::chrono::seconds(1), 2, 1};
  /// A pointing hand's press that draws less than this draws nothing: a fingertip trembles by a millimetre.
  double min_curve_m = 0.003;
  /// The potentiometer's turn that counts as turned, of its whole turn: ten times its noise. Before that, a
  /// shape that is moved keeps its size and a touched exponent its step.
  double dial_slack = 0.03;
  double scale_octaves = 2.0;  ///< A whole turn of the potentiometer scales by 2 to this power.
  /// The steps of the exponent's cell (A22): stars, diamond, ellipse, and towards the rectangle.
  std::array<double, 6> exponents{0.5, 1.0, 2.0, 3.0, 5.0, 10.0};
  /// Where a duplicate lies, so that it is seen: beside the original, towards the palette's free side.
  Eigen::Vector3d duplicate_offset_m{0.0, 0.03, 0.0};
  /// How long presence tells of a gesture that was refused or lost at its end: as long as reading it takes.
  Duration tell_for = std::chrono::seconds(3);
  FistOptions fist_hold;  ///< Of a fist that takes an icon or a whole shape along.
  /// A fist that holds an icon has moved when it moved this much, or turned at all: it trembles less.
  double icon_slack_m = 0.002;
  double least_bend = 0.05;     ///< Of a curve's length: the reach of a bend at the potentiometer's bottom.
  double icon_tap_m = 0.01;     ///< A tap this close to an icon means that one, not another beside it.
  double icon_curve_m = 0.008;  ///< A press that goes farther from where it began than this is no tap.
  DrawnCurveOptions drawn_curve;
  std::uint32_t sculpt_control = 20;  ///< Control points a side of a new sculpted surface: 1 cm apart.
  double soft = 0.5;                  ///< Of the stiffness that follows the hand (D16).
  double stiff = 2.0;
  SheetOptions sheet;
  SpaceMouseOptions space_mouse;
  HandCentreOptions centre;
  SampleLimits limits;
};

}  // namespace handloft::interaction
