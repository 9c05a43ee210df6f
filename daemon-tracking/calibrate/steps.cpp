#include "daemon-tracking/calibrate/steps.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>

namespace handloft::tracking {

void tell(const StepContext& context, const std::string& what, const StepResult& result) {
  if (context.terminal != nullptr)
    fmt::print(context.terminal, "{}: {}. {}\n", what, to_string(result.verdict), result.words);
}

Result<Verdict> run_print(StepContext& context) {
  PrintOptions options;
  options.paper = context.options.paper == "letter" ? Paper::letter : Paper::a4;
  options.chessboard = context.options.chessboard();
  options.charuco = context.options.charuco();
  options.table = context.options.table_print();
  const auto pages = lay_out_pages(context.calibration.rig, options);
  if (!pages) return pages.error();
  const std::filesystem::path path = std::filesystem::path(context.options.out) / "handloft-print.pdf";
  if (const Status written = write_pdf(*pages, path); !written) return written.error();
  if (context.terminal != nullptr) {
    fmt::print(context.terminal, "{}: {} pages. Print at 100 %, and measure the ruler on each page:\n",
               path.string(), pages->size());
    for (const PrintPage& page : *pages) fmt::print(context.terminal, "  {}\n", page.title);
  }
  return Verdict::good;
}

Result<Verdict> run_step(const CalibrateOptions& options, const std::string& date, std::FILE* terminal) {
  Calibration calibration;
  Result<Calibration> loaded = load_calibration(options.file);
  if (loaded) {
    calibration = std::move(*loaded);
  } else if (loaded.error().code == ErrorCode::not_found && options.step != "check") {
    calibration = calibration_of(default_rig());
    if (terminal != nullptr)
      fmt::print(terminal, "{} is begun: cameras left and right over the table, head on the display.\n",
                 options.file);
  } else {
    return loaded.error();
  }
  std::error_code problem;
  std::filesystem::create_directories(options.out, problem);
  if (problem) return make_error(ErrorCode::io, problem.message(), options.out);

  StepContext context{options, calibration, date, terminal};
  const std::map<std::string, Result<Verdict> (*)(StepContext&)> steps = {
      {"print", run_print},       {"intrinsics", run_intrinsics}, {"extrinsics", run_extrinsics},
      {"head-rig", run_head_rig}, {"colours", run_colours},       {"glove", run_glove},
      {"check", run_check}};
  const auto step = steps.find(options.step);
  if (step == steps.end())
    return make_error(ErrorCode::invalid_argument, fmt::format("found '{}', expected a step", options.step),
                      "step");
  const Result<Verdict> verdict = step->second(context);
  if (!verdict) return verdict.error();
  if (options.step == "check" || *verdict == Verdict::bad) return *verdict;
  calibration.date = date;
  if (const Status saved = save_calibration(calibration, options.file); !saved) return saved.error();
  if (terminal != nullptr) fmt::print(terminal, "Written to {}.\n", options.file);
  return *verdict;
}

}  // namespace handloft::tracking
