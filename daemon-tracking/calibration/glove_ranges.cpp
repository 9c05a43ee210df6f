#include "daemon-tracking/calibration/glove_ranges.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace handloft::tracking {
namespace {

// Above the noise by this much, a resting pad never presses.
constexpr double rest_sigmas = 4.0;
// The stops of the potentiometer are reached a little before its ends, so that both can be.
constexpr double stop_steps = 4.0;
constexpr double converter_max = glove_analogue_max;
constexpr double mad_to_sigma = 1.4826;

double quantile(const std::vector<double>& sorted, double share) {
  const double at = share * static_cast<double>(sorted.size() - 1);
  return sorted[static_cast<std::size_t>(std::lround(at))];
}

}  // namespace

Result<GloveCalibration> calibrate_glove(const std::vector<GloveReport>& reports,
                                         const GloveRangeOptions& options) {
  const auto refused = [](std::string words) {
    return make_error(ErrorCode::failed_precondition, std::move(words), "glove");
  };
  if (reports.size() < options.min_reports)
    return refused(fmt::format("found {} reports, expected at least {}: is the glove plugged in?",
                               reports.size(), options.min_reports));
  std::vector<double> force, turn;
  for (const GloveReport& report : reports) {
    force.push_back(report.force);
    turn.push_back(report.potentiometer);
  }
  std::sort(force.begin(), force.end());
  std::sort(turn.begin(), turn.end());

  GloveCalibration made;
  const double rest = quantile(force, options.rest_share / 2);
  std::vector<double> spread;
  for (const double value : force)
    if (value <= quantile(force, options.rest_share)) spread.push_back(std::abs(value - rest));
  std::sort(spread.begin(), spread.end());
  made.rest_noise_steps = mad_to_sigma * quantile(spread, 0.5);
  GloveRanges& ranges = made.ranges;
  ranges.force_zero = std::min(rest + rest_sigmas * std::max(1.0, made.rest_noise_steps), converter_max - 1);
  ranges.force_full = quantile(force, 1.0 - options.press_share / 2);
  if (ranges.force_full - ranges.force_zero < options.min_force_steps)
    return refused(
        fmt::format("the force went from {:.0f} at rest to {:.0f}, expected {:.0f} steps more: rest the "
                    "hand, then press as "
                    "hard as you want full pressure to be, five times",
                    ranges.force_zero, ranges.force_full, options.min_force_steps));
  ranges.potentiometer_low = std::min(quantile(turn, 0.01) + stop_steps, converter_max - 1);
  ranges.potentiometer_high = std::max(quantile(turn, 0.99) - stop_steps, 0.0);
  if (ranges.potentiometer_high - ranges.potentiometer_low < options.min_potentiometer_steps)
    return refused(
        fmt::format("the potentiometer went from {:.0f} to {:.0f}, expected {:.0f} steps at least: turn it "
                    "from stop to stop",
                    ranges.potentiometer_low, ranges.potentiometer_high, options.min_potentiometer_steps));
  StepResult& result = made.result;
  const double noise_share = made.rest_noise_steps / (ranges.force_full - ranges.force_zero);
  result.residual = 100 * noise_share;
  result.unit = "% noise";
  // The pen presses at 8 % (GloveOptions): noise must stay far below.
  const bool clipped = ranges.force_full >= converter_max - 2;
  result.verdict = noise_share > 0.04               ? Verdict::bad
                   : noise_share > 0.015 || clipped ? Verdict::usable
                                                    : Verdict::good;
  result.words =
      fmt::format("force {:.0f} to {:.0f}, noise {:.1f} steps at rest; potentiometer {:.0f} to {:.0f}.{}{}",
                  ranges.force_zero, ranges.force_full, made.rest_noise_steps, ranges.potentiometer_low,
                  ranges.potentiometer_high,
                  clipped ? " The pad reaches the converter's end: a larger series resistor would help." : "",
                  noise_share > 0.015 ? " The pad is noisy: look at its wires." : "");
  return made;
}

}  // namespace handloft::tracking
