#pragma once
// The steps of handloft-calibrate. Each reads its samples, shows what it found, writes pictures, and tells
// the verdict; the calibration is changed only when it is not bad.

#include <cstdio>
#include <string>

#include "common/base/result.h"
#include "daemon-tracking/calibrate/input.h"
#include "daemon-tracking/calibrate/options.h"
#include "daemon-tracking/source/calibration_file.h"

namespace handloft::tracking {

struct StepContext {
  const CalibrateOptions& options;
  Calibration& calibration;
  std::string date;     ///< ISO 8601, UTC.
  std::FILE* terminal;  ///< Where progress and verdicts go; nullptr: nowhere.
};

/// The worst verdict of the step. Errors: refused data, with the reason and what to do.
Result<Verdict> run_print(StepContext& context);
Result<Verdict> run_intrinsics(StepContext& context);
Result<Verdict> run_extrinsics(StepContext& context);
Result<Verdict> run_head_rig(StepContext& context);
Result<Verdict> run_colours(StepContext& context);
Result<Verdict> run_glove(StepContext& context);
Result<Verdict> run_check(StepContext& context);

/// Reads the calibration file (or begins one from the rig that is printed when there is none), runs the step
/// and saves. `date` is written into it.
Result<Verdict> run_step(const CalibrateOptions& options, const std::string& date, std::FILE* terminal);

/// "left: good. 0.21 px over ..." on the terminal.
void tell(const StepContext& context, const std::string& what, const StepResult& result);

}  // namespace handloft::tracking
