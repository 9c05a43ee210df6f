// handloft-calibrate: see --help, and daemon-tracking/calibration/README.md for the guide.

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <glog/logging.h>

#include <chrono>
#include <cstdio>

#include "daemon-tracking/calibrate/options.h"
#include "daemon-tracking/calibrate/steps.h"

namespace {

int fail(const handloft::Error& error) {
  fmt::print(stderr, "handloft-calibrate: {}\n", error.describe());
  return error.code == handloft::ErrorCode::invalid_argument ? handloft::tracking::calibrate_usage
                                                             : handloft::tracking::calibrate_failed;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace handloft;
  // Ceres' own log is for programmers; what matters of it is in the verdicts.
  FLAGS_minloglevel = google::GLOG_FATAL;
  tracking::CalibrateOptions options;
  OptionTable table = tracking::make_calibrate_table(options);
  const Result<ParseOutcome> parsed = table.parse(argc, argv);
  if (!parsed) return fail(parsed.error());
  if (parsed->action == ParseOutcome::Action::show_text) {
    std::fputs(parsed->text.c_str(), stdout);
    return tracking::calibrate_ok;
  }
  if (const Status good = tracking::check_calibrate_options(options); !good) return fail(good.error());
  const auto now = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
  const auto verdict =
      tracking::run_step(options, fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(now)), stdout);
  if (!verdict) return fail(verdict.error());
  return *verdict == tracking::Verdict::bad ? tracking::calibrate_failed : tracking::calibrate_ok;
}
