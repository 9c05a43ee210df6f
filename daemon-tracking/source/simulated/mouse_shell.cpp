#include "daemon-tracking/source/simulated/mouse_shell.h"

#include <fmt/format.h>
#include <cmath>
#include <numbers>

namespace handloft::tracking {
namespace mouse_shell {
namespace {

using Eigen::Vector3d;
constexpr double pi = std::numbers::pi;

// Where the top's strokes run: the right half and a little over the plane of symmetry.
constexpr double first_x_m = -0.004, last_x_m = 0.030, stroke_half_length_m = 0.052;
constexpr double across_y_m = 0.028, across_s = 0.55;
constexpr double side_stroke_half_length_m = 0.046;
/// A hand's line is never quite straight: amplitude of its wave.
constexpr double wave_m = 0.0012;
/// On the side the palm turns towards the wall.
constexpr double side_roll_rad = 0.6;

/// Where the hand rests at the end: beside the shape, in view of all cameras, and over no palette cell.
const Vector3d rest_m(-0.15, -0.02, 0.07);
constexpr double rest_s = 1.0;

/// Pressure grows and fades over the first and last part of a stroke and swings around a level of its own.
double pressure_course(double u, double level, double swing) {
  constexpr double fade = 0.14;
  const double edge = std::min({1.0, u / fade, (1.0 - u) / fade});
  const double smooth = edge * edge * (3 - 2 * edge);
  return smooth * std::clamp(level + swing * std::sin(2 * pi * u), 0.3, 1.0);
}

void draw_top(HandProgram& program, const Options& options) {
  const int count = std::max(2, options.top_strokes);
  for (int i = 0; i < count; ++i) {
    const double x0 = first_x_m + (last_x_m - first_x_m) * i / (count - 1);
    const double direction = i % 2 == 0 ? 1.0 : -1.0;
    const double level = 0.45 + 0.12 * (i % 4);
    program.stroke(
        fmt::format("top {}", i + 1),
        [=](double u) -> Vector3d {
          const double y = direction * stroke_half_length_m * (2 * u - 1);
          const double x = x0 + wave_m * std::sin(2 * pi * u + i);
          return {x, y, top_height_m(x, y)};
        },
        options.stroke_s, [=](double u) { return pressure_course(u, level, 0.2); });
  }
  for (const double y0 : {across_y_m, -across_y_m}) {
    program.stroke(
        fmt::format("top across at y {:.0f} mm", y0 * 1e3),
        [=](double u) -> Vector3d {
          const double x = first_x_m + (last_x_m - first_x_m) * (y0 > 0 ? 1 - u : u);
          const double y = y0 + wave_m * std::sin(2 * pi * u);
          return {x, y, top_height_m(x, y)};
        },
        across_s, [=](double u) { return pressure_course(u, 0.7, 0.1); });
  }
}

void draw_side(HandProgram& program, const Options& options) {
  const int count = std::max(2, options.side_strokes);
  const Eigen::Quaterniond tilt(Eigen::AngleAxisd(side_roll_rad, Vector3d::UnitY()));
  for (int i = 0; i < count; ++i) {
    const double z0 = side_bottom_m + (side_top_m - side_bottom_m) * i / (count - 1);
    const double direction = i % 2 == 0 ? 1.0 : -1.0;
    program.stroke(
        fmt::format("side {}", i + 1),
        [=](double u) -> Vector3d {
          const double y = direction * side_stroke_half_length_m * (2 * u - 1);
          const double z = z0 + wave_m * std::sin(2 * pi * u + i);
          return {side_x_m(y, z), y, z};
        },
        options.stroke_s, [=](double u) { return pressure_course(u, 0.6, 0.25); }, tilt);
  }
}

}  // namespace

double top_distance_m(const Vector3d& p) {
  const Vector3d gradient(20.0 * p.x(), 0.06 + 6.6 * p.y(), 1.0);
  return (p.z() - top_height_m(p.x(), p.y())) / gradient.norm();
}

double side_distance_m(const Vector3d& p) {
  const Vector3d gradient(1.0, 8.0 * p.y(), 0.25);
  return (p.x() - side_x_m(p.y(), p.z())) / gradient.norm();
}

}  // namespace mouse_shell

HandProgram mouse_shell_program(const mouse_shell::Options& options) {
  HandProgram program(options.hand);
  program.idle(1.0);
  program.touch(PaletteCommand::symmetry);
  mouse_shell::draw_top(program, options);
  program.touch(PaletteCommand::fit);
  program.touch(PaletteCommand::new_shape);
  if (options.side_symmetry == mouse_shell::SideSymmetry::toggle) program.touch(PaletteCommand::symmetry);
  mouse_shell::draw_side(program, options);
  program.touch(PaletteCommand::fit);
  program.touch(PaletteCommand::representation);
  program.touch(PaletteCommand::representation);
  program.gesture(HandPose::open, mouse_shell::rest_m, mouse_shell::rest_s);
  return program;
}

}  // namespace handloft::tracking
