#include "daemon-tracking/source/simulated/sculpt_program.h"

#include <string>
#include <utility>

namespace handloft::tracking {
namespace sculpt {
namespace {

using Eigen::Vector3d;

constexpr double idle_s = 0.5;
const Vector3d rest_m(-0.02, -0.10, 0.17);
constexpr double tap_pressure = 0.6;
/// Of a tap's time to either side of the press.
constexpr double tap_edge = 0.25;

void tap(HandProgram& program, std::string label, const Vector3d& place, const Options& options) {
  program.draw(
      std::move(label), [=](double) { return place; }, options.tap_s,
      [](double u) { return u > tap_edge && u < 1 - tap_edge ? tap_pressure : 0.0; });
}

void drag(HandProgram& program, std::string label, const Vector3d& from, const Vector3d& way,
          const Options& options, const Eigen::Quaterniond& turn = Eigen::Quaterniond::Identity()) {
  program.drag(
      std::move(label), [=](double u) -> Vector3d { return from + u * way; }, options.drag_s, turn);
}

}  // namespace
}  // namespace sculpt

HandProgram sculpt_program(const sculpt::Options& options) {
  using namespace sculpt;
  HandProgram program(options.hand);
  program.idle(idle_s);
  program.touch(PaletteCommand::sculpt);
  tap(program, "anchor 1", {-anchor_x_m, -anchor_y_m, sheet_z_m}, options);
  tap(program, "anchor 2", {-anchor_x_m, anchor_y_m, sheet_z_m}, options);
  tap(program, "anchor 3", {anchor_x_m, anchor_y_m, sheet_z_m}, options);
  tap(program, "anchor 4", {anchor_x_m, -anchor_y_m, sheet_z_m}, options);
  tap(program, "lifted", lifted_m, options);
  drag(program, "lift", lifted_m, lift_m, options);
  tap(program, "turned", turned_m, options);
  program.touch(PaletteCommand::icon_property);
  drag(program, "turn", turned_m, Eigen::Vector3d::Zero(), options,
       Eigen::Quaterniond(Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitY())));
  tap(program, "loaded", loaded_m, options);
  program.touch(PaletteCommand::icon_role);
  program.touch(PaletteCommand::icon_stiffness);
  drag(program, "load", loaded_m, load_m, options);
  tap(program, "select lifted", lifted_m + lift_m, options);
  program.touch(PaletteCommand::icon_state);
  drag(program, "in vain", lifted_m + lift_m, in_vain_m, options);
  program.touch(PaletteCommand::commit_sculpting);
  tap(program, "pressed", pressed_m, options);
  drag(program, "press", pressed_m, press_m, options);
  program.touch(PaletteCommand::recover_sculpting);
  program.gesture(HandPose::open, rest_m, idle_s);
  return program;
}

}  // namespace handloft::tracking
