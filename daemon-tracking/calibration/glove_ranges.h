#pragma once
// What the glove's force pad and potentiometer say at rest and at their ends (T9, T11), from a stretch in
// which the hand rests, presses hard a few times and turns the potentiometer from stop to stop. Pure.

#include <vector>

#include "common/base/result.h"
#include "daemon-tracking/source/calibration_file.h"
#include "daemon-tracking/source/glove_report.h"

namespace handloft::tracking {

struct GloveRangeOptions {
  std::size_t min_reports = 250;   ///< One second.
  double rest_share = 0.2;         ///< At least this part of the time nothing is pressed.
  double press_share = 0.03;       ///< And this part is pressed hard.
  double min_force_steps = 100.0;  ///< Between rest and full: less makes a staircase of the pressure.
  double min_potentiometer_steps = 300.0;
};

struct GloveCalibration {
  GloveRanges ranges;
  double rest_noise_steps = 0.0;  ///< Standard deviation at rest.
  StepResult result;              ///< Without date.
};

/// Errors: failed_precondition with what to do: too few reports, never pressed, never at rest, potentiometer
/// hardly turned.
Result<GloveCalibration> calibrate_glove(const std::vector<GloveReport>& reports,
                                         const GloveRangeOptions& options = {});

}  // namespace handloft::tracking
