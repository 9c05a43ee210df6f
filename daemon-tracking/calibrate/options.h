#pragma once
// The command line of handloft-calibrate.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/config.h"
#include "common/base/result.h"
#include "daemon-tracking/calibration/board.h"
#include "daemon-tracking/calibration/print.h"

namespace handloft::tracking {

struct CalibrateOptions {
  std::string step;
  std::string file = "calibration.toml";
  std::string out = "calibration-pictures";
  std::optional<std::string> recording, images;
  bool simulate = false;
  std::vector<std::string> cameras;  ///< NAME, or NAME=SELECTOR for a live one.
  std::string board = "chessboard";
  int columns = 9, rows = 6;
  double square_mm = 25.0;
  double marker_mm = 18.75;
  std::string dictionary = "5x5_100";
  std::string table = "glued";
  std::string paper = "a4";
  double seconds = 30.0;
  double exposure_ms = 5.0;
  bool row_times = false;
  std::uint64_t seed = 1;

  ChessboardShape chessboard() const { return {columns, rows, 1e-3 * square_mm}; }
  CharucoShape charuco() const;
  /// What intrinsics looks for, and what extrinsics does beside the table's tags.
  Board intrinsics_board(const std::vector<TagPlacement>& table_tags) const;
  Board extrinsics_board() const;
  TablePrint table_print() const { return table == "one-sheet" ? TablePrint::one_sheet : TablePrint::glued; }
};

enum CalibrateExit : int {
  calibrate_ok = 0,      ///< Done; the verdict is good or usable.
  calibrate_failed = 1,  ///< Refused or failed, or the verdict is bad: the file was left as it was.
  calibrate_usage = 2,
};

OptionTable make_calibrate_table(CalibrateOptions& options);

/// Options that don't go together. Errors: invalid_argument naming the flag.
Status check_calibrate_options(const CalibrateOptions& options);

}  // namespace handloft::tracking
