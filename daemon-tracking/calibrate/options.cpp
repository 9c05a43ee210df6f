#include "daemon-tracking/calibrate/options.h"

namespace handloft::tracking {

OptionTable make_calibrate_table(CalibrateOptions& options) {
  OptionTable table(
      "handloft-calibrate",
      "Measures a lab's cameras, tags, fingertip caps and glove, step by step, into one file for "
      "handloft-trackd.\n"
      "Steps, in this order: print, intrinsics, extrinsics, head-rig, colours, glove, check.\n"
      "Exit status: 0 done, the verdict is good or usable; 1 refused, failed or bad, and the file was "
      "left as it was; 2 wrong usage.");
  table.add_positional(
      "step", options.step, "What to do", OptionTable::Presence::required,
      {.choices = {"print", "intrinsics", "extrinsics", "head-rig", "colours", "glove", "check"}});
  table.add("file", options.file, "The calibration file: read, completed, written",
            {.value_name = "FILE.toml"});
  table.add("out", options.out, "Where pictures of what was seen, and the PDF, are put",
            {.value_name = "FOLDER"});
  table.add("recording", options.recording, "Use what handloft-trackd recorded", {.value_name = "FILE"});
  table.add("images", options.images, "Use pictures: CAMERA/*.jpg or CAMERA*.jpg, JPEG or PNG",
            {.value_name = "FOLDER"});
  table.add("simulate", options.simulate, "Use the simulated rig: to try the steps without devices");
  table.add("camera", options.cameras,
            "Only this camera (may be given again); NAME=serial=..., NAME=path=... or NAME=/dev/video0 says "
            "which device it is",
            {.value_name = "NAME[=DEVICE]"});
  table.add("board", options.board,
            "What intrinsics looks for (extrinsics: a chessboard unless it is charuco)",
            {.choices = {"chessboard", "charuco", "table"}});
  table.add("columns", options.columns, "Inner corners of the board along its longer side",
            {.min = 3, .max = 30});
  table.add("rows", options.rows, "Inner corners along its shorter side", {.min = 3, .max = 30});
  table.add("square_mm", options.square_mm, "Edge of its squares, as measured with a ruler",
            {.min = 2, .max = 500});
  table.add("marker_mm", options.marker_mm, "Black edge of a ChArUco board's markers, as measured",
            {.min = 1, .max = 450});
  table.add("dictionary", options.dictionary, "A ChArUco board's markers",
            {.choices = {"4x4_50", "5x5_100", "6x6_250"}});
  table.add("table", options.table, "How the table's tags got where they are",
            {.choices = {"glued", "one-sheet"}});
  table.add("paper", options.paper, "What is printed on", {.choices = {"a4", "letter"}});
  table.add("seconds", options.seconds, "How long devices are listened to", {.min = 1, .max = 600});
  table.add("exposure_ms", options.exposure_ms, "Of live cameras", {.min = 0.1, .max = 100});
  table.add("row_times", options.row_times, "Also measure rolling shutters (head-rig, extrinsics)");
  table.add("seed", options.seed, "Of the simulated rig");
  return table;
}

CharucoShape CalibrateOptions::charuco() const {
  CharucoShape shape;
  shape.corners = chessboard();
  shape.marker_m = 1e-3 * marker_mm;
  shape.dictionary = dictionary == "4x4_50"    ? MarkerDictionary::m4x4_50
                     : dictionary == "6x6_250" ? MarkerDictionary::m6x6_250
                                               : MarkerDictionary::m5x5_100;
  return shape;
}

Board CalibrateOptions::intrinsics_board(const std::vector<TagPlacement>& table_tags) const {
  return board == "table" ? Board::of_tags(table_tags) : extrinsics_board();
}

Board CalibrateOptions::extrinsics_board() const {
  return board == "charuco" ? Board::of_charuco(charuco()) : Board::chess(chessboard());
}

Status check_calibrate_options(const CalibrateOptions& options) {
  const int sources = (options.recording ? 1 : 0) + (options.images ? 1 : 0) + (options.simulate ? 1 : 0);
  if (sources > 1)
    return make_error(ErrorCode::invalid_argument,
                      "found several of --recording, --images and --simulate, expected one", "source");
  if (options.simulate && options.board == "charuco")
    return make_error(ErrorCode::invalid_argument,
                      "the simulated lab has a chessboard: expected --board chessboard or table", "board");
  if (options.images && options.step == "glove")
    return make_error(ErrorCode::invalid_argument,
                      "pictures tell nothing of a glove: expected --recording or a live one", "images");
  if (options.images && options.step == "head-rig")
    return make_error(ErrorCode::invalid_argument,
                      "pictures don't move: expected --recording or live cameras", "images");
  return {};
}

}  // namespace handloft::tracking
