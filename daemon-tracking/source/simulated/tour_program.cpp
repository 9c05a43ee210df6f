#include "daemon-tracking/source/simulated/tour_program.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace handloft::tracking {
namespace tour {
namespace {

using Eigen::Vector3d;
constexpr double pi = std::numbers::pi;

constexpr double idle_s = 0.6;
/// A hand's line is never quite straight.
constexpr double wave_m = 0.001;
/// From here the closed hand comes down and hither it goes back: farther from the lid than a hand reaches.
constexpr double above_m = 0.075;
constexpr double push_s = 2.4, draw_s = 1.6, loop_s = 3.2;
constexpr double loop_z_m = 0.118;
const Vector3d rest_m(-0.02, -0.10, 0.16);

/// Grows and fades over the first and last part of a path.
double faded(double u, double level, double fade) {
  const double edge = std::clamp(std::min(u, 1.0 - u) / fade, 0.0, 1.0);
  return level * edge * edge * (3 - 2 * edge);
}

void lay_lid(HandProgram& program, const Options& options) {
  const int count = std::max(2, options.strokes);
  for (int i = 0; i < count; ++i) {
    const double x0 = half_width_m * (2.0 * i / (count - 1) - 1.0);
    const double direction = i % 2 == 0 ? 1.0 : -1.0;
    program.stroke(
        fmt::format("lid {}", i + 1),
        [=](double u) -> Vector3d {
          const double y = direction * half_length_m * (2 * u - 1);
          const double x = x0 + wave_m * std::sin(2 * pi * u + i);
          return {x, y, lid_height_m(x, y)};
        },
        options.stroke_s, [](double u) { return faded(u, 0.65, 0.12); });
  }
}

/// Down and up again, slowest at the bottom.
Vector3d dent_path(double u) {
  const double down = 0.5 - 0.5 * std::cos(2 * pi * u);
  return {dent_x_m, dent_y_m, dent_z_m + above_m * (1 - down)};
}

}  // namespace

Vector3d ridge(double u) {
  const double y = half_length_m * 0.85 * (2 * u - 1);
  return {0.0, y, lid_height_m(0.0, y) + ridge_m};
}

Vector3d flank(double u) {
  const double x = half_width_m * 0.9 * (2 * u - 1);
  const double away = std::max(0.0, (u - flank_tap) / (1 - flank_tap));
  return {x, 0.0, lid_height_m(x, 0.0) + flank_m + flank_end_m * away};
}

Vector3d loop(double u) {
  const double angle = 2 * pi * u;
  return {loop_half_width_m * std::sin(angle), -loop_half_length_m * std::cos(angle), loop_z_m};
}

}  // namespace tour

HandProgram tour_program(const tour::Options& options) {
  HandProgram program(options.hand);
  program.idle(tour::idle_s);
  tour::lay_lid(program, options);
  program.touch(PaletteCommand::fit);
  program.touch(PaletteCommand::both);
  program.touch(PaletteCommand::falloff);
  program.push(
      "dent", tour::dent_path, tour::push_s,
      [](double u) { return tour::faded(u, tour::dent_pressure, 0.1); }, tour::dent_range);
  program.touch(PaletteCommand::undo);
  program.touch(PaletteCommand::redo);
  program.draw("ridge", tour::ridge, tour::draw_s, [](double u) { return tour::faded(u, 0.6, 0.06); });
  program.draw("flank", tour::flank, tour::draw_s, [](double u) { return tour::faded(u, 0.6, 0.06); },
               Eigen::Quaterniond::Identity(), {tour::flank_tap});
  program.touch(PaletteCommand::trim_mode);
  program.draw("loop", tour::loop, tour::loop_s, [](double u) { return tour::faded(u, 0.6, 0.01); });
  program.touch(PaletteCommand::trim_mode);
  program.touch(PaletteCommand::new_alternative);
  program.touch(PaletteCommand::degree);
  program.touch(PaletteCommand::next_alternative);
  program.gesture(HandPose::open, tour::rest_m, tour::idle_s);
  return program;
}

}  // namespace handloft::tracking
