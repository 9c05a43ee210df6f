#pragma once
// What is printed for a lab (T11): the table's tags with a plan of where they go (or the whole board as one
// poster), the head rig's tags as faces with tabs and their places, a chessboard and a ChArUco board, and the
// chart of the fingertips' colours. To scale, A4 or Letter, with a ruler on every page that tells whether the
// printer kept it. The same drawing makes the PDF and the picture that tests look for tags in.

#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "daemon-tracking/calibration/board.h"
#include "daemon-tracking/calibration/extrinsics.h"
#include "daemon-tracking/source/rig.h"
#include "daemon-tracking/vision/image_decode.h"

namespace handloft::tracking {

enum class Paper : std::uint8_t { a4, letter };

struct PrintOptions {
  Paper paper = Paper::a4;
  ChessboardShape chessboard;
  CharucoShape charuco;
  /// The table's board in one piece, 1:1, for a plotter; else its tags to be cut out and glued.
  TablePrint table = TablePrint::glued;
};

/// Millimetres from the page's top left corner, x right, y down.
struct PageRectangle {
  double x_mm, y_mm, width_mm, height_mm;
  double red = 0, green = 0, blue = 0;
};
enum class PageLineKind : std::uint8_t { solid, cut, fold };
struct PageLine {
  double from_x_mm, from_y_mm, to_x_mm, to_y_mm;
  PageLineKind kind = PageLineKind::solid;
};
struct PageText {
  double x_mm, y_mm, size_mm;
  std::string words;
};
/// A tag's black square: for tests, and for whoever wants to know where it went.
struct PageTag {
  int id;
  double centre_x_mm, centre_y_mm, edge_mm;
};

struct PrintPage {
  std::string title;
  double width_mm = 210, height_mm = 297;
  std::vector<PageRectangle> rectangles;
  std::vector<PageLine> lines;
  std::vector<PageText> texts;
  std::vector<PageTag> tags;
};

/// Errors: invalid_argument for tags that the family does not have, or that fit no page; for a chessboard
/// or ChArUco board that does not fit or that check_charuco() refuses.
Result<std::vector<PrintPage>> lay_out_pages(const Rig& rig, const PrintOptions& options);

/// All pages in one PDF. Errors: io, naming the file.
Status write_pdf(const std::vector<PrintPage>& pages, const std::filesystem::path& path);

/// A page as a printer would make it, in grey. `dots_per_mm` 1..40.
Result<Plane> rasterise(const PrintPage& page, double dots_per_mm);

}  // namespace handloft::tracking
