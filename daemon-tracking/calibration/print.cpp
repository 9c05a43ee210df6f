#include "daemon-tracking/calibration/print.h"

#include <cairo-pdf.h>
#include <cairo.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "daemon-tracking/source/simulated/tag_bitmap.h"

namespace handloft::tracking {
namespace {

constexpr double margin_mm = 10.0;  // No desk printer prints to the edge.
constexpr double ruler_mm = 100.0;
constexpr double footer_mm = 16.0;  // Room for the ruler.
constexpr double header_mm = 10.0;
constexpr double gap_mm = 6.0;
constexpr double points_per_mm = 72.0 / 25.4;
constexpr double largest_poster_mm = 3000.0;
constexpr const char* finger_words[] = {"thumb", "index finger", "middle finger", "ring finger",
                                        "little finger"};

Error refused(std::string words) {
  return make_error(ErrorCode::invalid_argument, std::move(words), "print");
}

PrintPage blank(Paper paper, bool landscape, std::string title) {
  PrintPage page;
  page.width_mm = paper == Paper::a4 ? 210.0 : 215.9;
  page.height_mm = paper == Paper::a4 ? 297.0 : 279.4;
  if (landscape) std::swap(page.width_mm, page.height_mm);
  page.title = std::move(title);
  return page;
}

/// Title above, ruler below: drawn last, so that the page's size is final.
void finish(PrintPage& page) {
  page.texts.push_back({margin_mm, margin_mm + 3.5, 4.0, "Handloft: " + page.title});
  const double y = page.height_mm - margin_mm - 6.0;
  page.lines.push_back({margin_mm, y, margin_mm + ruler_mm, y});
  for (int tick = 0; tick <= 100; ++tick) {
    const double length = tick % 10 == 0 ? 4.0 : tick % 5 == 0 ? 2.5 : 1.5;
    page.lines.push_back({margin_mm + tick, y, margin_mm + tick, y - length});
  }
  page.texts.push_back(
      {margin_mm, y + 4.5, 3.0,
       "This ruler must measure 100 mm. If it does not, print again at 100 % (no \"fit to page\")."});
}

/// The dark cells of a bitmap of square cells, as runs: no hairlines between them in a viewer.
void add_dark_cells(PrintPage& page, const std::vector<std::vector<bool>>& dark, double left_mm,
                    double top_mm, double cell_mm) {
  for (std::size_t row = 0; row < dark.size(); ++row) {
    for (std::size_t column = 0; column < dark[row].size();) {
      std::size_t end = column;
      while (end < dark[row].size() && dark[row][end]) ++end;
      if (end > column)
        page.rectangles.push_back({left_mm + static_cast<double>(column) * cell_mm,
                                   top_mm + static_cast<double>(row) * cell_mm,
                                   static_cast<double>(end - column) * cell_mm, cell_mm});
      column = std::max(end, column + 1);
    }
  }
}

Status add_tag(PrintPage& page, int id, double centre_x_mm, double centre_y_mm, double edge_mm) {
  const auto bitmap = tag_bitmap(id);
  if (!bitmap) return refused(fmt::format("tag {} is not in the family 36h11 (0 to 586)", id));
  const double cell = edge_mm / TagBitmap::border_cells;
  const double left = centre_x_mm - 0.5 * cell * TagBitmap::cells,
               top = centre_y_mm - 0.5 * cell * TagBitmap::cells;
  std::vector<std::vector<bool>> dark;
  for (const auto& row : bitmap->white) {
    std::vector<bool>& line = dark.emplace_back();
    for (const bool white : row) line.push_back(!white);
  }
  add_dark_cells(page, dark, left, top, cell);
  page.tags.push_back({id, centre_x_mm, centre_y_mm, edge_mm});
  return {};
}

void outline(PrintPage& page, double x, double y, double width, double height, PageLineKind kind) {
  page.lines.push_back({x, y, x + width, y, kind});
  page.lines.push_back({x + width, y, x + width, y + height, kind});
  page.lines.push_back({x + width, y + height, x, y + height, kind});
  page.lines.push_back({x, y + height, x, y, kind});
}

double sheet_mm(const TagPlacement& tag) {
  return 1e3 * TagBitmap::sheet_edge_m(tag.edge_m);
}

/// Cards to be cut out, as many as fit on each page.
Status table_cards(const Rig& rig, Paper paper, std::vector<PrintPage>& pages) {
  PrintPage page = blank(paper, false, "table tags, to be cut out");
  double x = margin_mm, y = margin_mm + header_mm, row_height = 0;
  for (const TagPlacement& tag : rig.table_tags) {
    const double side = sheet_mm(tag) + 2.0, label = 5.0;
    if (side > page.width_mm - 2 * margin_mm ||
        side + label > page.height_mm - 2 * margin_mm - header_mm - footer_mm)
      return refused(fmt::format("tag {} of {:.0f} mm fits no page", tag.id, 1e3 * tag.edge_m));
    if (x + side > page.width_mm - margin_mm) {
      x = margin_mm;
      y += row_height + gap_mm;
      row_height = 0;
    }
    if (y + side + label > page.height_mm - margin_mm - footer_mm) {
      finish(page);
      pages.push_back(std::move(page));
      page = blank(paper, false, "table tags, to be cut out (continued)");
      x = margin_mm;
      y = margin_mm + header_mm;
      row_height = 0;
    }
    if (const Status added = add_tag(page, tag.id, x + 0.5 * side, y + 0.5 * side, 1e3 * tag.edge_m); !added)
      return added;
    outline(page, x, y, side, side, PageLineKind::cut);
    page.texts.push_back({x, y + side + 3.5, 3.0, fmt::format("tag {}, upper edge away from you", tag.id)});
    x += side + gap_mm;
    row_height = std::max(row_height, side + label);
  }
  finish(page);
  pages.push_back(std::move(page));

  // Where they go: a plan, smaller than life.
  PrintPage plan = blank(paper, true, "plan of the table (not to scale)");
  double reach_x = 0.05, reach_y = 0.05;
  for (const TagPlacement& tag : rig.table_tags) {
    reach_x = std::max(reach_x, std::abs(tag.body_from_tag.translation().x()) + tag.edge_m);
    reach_y = std::max(reach_y, std::abs(tag.body_from_tag.translation().y()) + tag.edge_m);
  }
  const double centre_x = plan.width_mm / 2, centre_y = (plan.height_mm + header_mm - footer_mm) / 2;
  const double scale = std::min((plan.width_mm - 2 * margin_mm) / (2e3 * reach_x),
                                (plan.height_mm - 2 * margin_mm - header_mm - footer_mm) / (2e3 * reach_y));
  plan.lines.push_back({centre_x - 5, centre_y, centre_x + 5, centre_y});
  plan.lines.push_back({centre_x, centre_y - 5, centre_x, centre_y + 5});
  plan.texts.push_back({centre_x + 2, centre_y - 2, 3.0, "0, 0: the middle of the work; you sit below"});
  for (const TagPlacement& tag : rig.table_tags) {
    const double x_mm = 1e3 * tag.body_from_tag.translation().x(),
                 y_mm = 1e3 * tag.body_from_tag.translation().y();
    const double side = scale * sheet_mm(tag);
    const double px = centre_x + scale * x_mm, py = centre_y - scale * y_mm;
    outline(plan, px - side / 2, py - side / 2, side, side, PageLineKind::solid);
    plan.texts.push_back({px - side / 2 + 1, py - 1, 3.0, fmt::format("tag {}", tag.id)});
    plan.texts.push_back({px - side / 2 + 1, py + 3, 2.6, fmt::format("{:+.0f}, {:+.0f} mm", x_mm, y_mm)});
  }
  plan.texts.push_back({margin_mm, margin_mm + header_mm, 3.0,
                        "Glue each tag flat with its middle at the place written in it, to a few "
                        "millimetres: extrinsics measures them."});
  finish(plan);
  pages.push_back(std::move(plan));
  return {};
}

/// The board in one piece.
Status poster(const Rig& rig, std::vector<PrintPage>& pages) {
  double left = 0, right = 0, far = 0, near = 0;
  for (const TagPlacement& tag : rig.table_tags) {
    const double half = 0.5 * sheet_mm(tag);
    const double x = 1e3 * tag.body_from_tag.translation().x(), y = 1e3 * tag.body_from_tag.translation().y();
    left = std::min(left, x - half);
    right = std::max(right, x + half);
    far = std::max(far, y + half);
    near = std::min(near, y - half);
  }
  PrintPage page;
  page.title = "table board, 1:1";
  page.width_mm = right - left + 4 * margin_mm;
  page.height_mm = far - near + 4 * margin_mm + header_mm + footer_mm;
  if (!(page.width_mm < largest_poster_mm && page.height_mm < largest_poster_mm))
    return refused(fmt::format("the board is {:.0f} x {:.0f} mm", page.width_mm, page.height_mm));
  const double x0 = 2 * margin_mm - left, y0 = 2 * margin_mm + header_mm + far;
  for (const TagPlacement& tag : rig.table_tags)
    if (const Status added = add_tag(page, tag.id, x0 + 1e3 * tag.body_from_tag.translation().x(),
                                     y0 - 1e3 * tag.body_from_tag.translation().y(), 1e3 * tag.edge_m);
        !added)
      return added;
  page.lines.push_back({x0 - 5, y0, x0 + 5, y0});
  page.lines.push_back({x0, y0 - 5, x0, y0 + 5});
  finish(page);
  pages.push_back(std::move(page));
  return {};
}

/// Where a face of the head rig goes, in words for hands: the rig's own numbers.
std::vector<std::string> head_place(const TagPlacement& tag) {
  const Eigen::Vector3d at = 1e3 * tag.body_from_tag.translation();
  const Eigen::Vector3d normal = tag.body_from_tag.linear().col(2);
  constexpr double degrees = 57.29577951;
  const double up = degrees * std::asin(std::clamp(normal.y(), -1.0, 1.0));
  const double left = degrees * std::atan2(-normal.x(), -normal.z());
  const auto side = [](double value, const char* positive, const char* negative) {
    return fmt::format("{:.0f} {}", std::abs(value), value < 0 ? negative : positive);
  };
  return {fmt::format("tag {}: mm {}, {}, {};", tag.id, side(at.x(), "right", "left"),
                      side(at.y(), "up", "down"), side(-at.z(), "forward", "back")),
          fmt::format("faces {} deg, {} deg", side(up, "up", "down"), side(left, "left", "right"))};
}

/// The head's tags as faces with tabs on all sides, each with the place where the rig has it: what head-rig
/// begins from.
Status head_fold_out(const Rig& rig, Paper paper, std::vector<PrintPage>& pages) {
  if (rig.head_tags.empty()) return {};
  std::vector<const TagPlacement*> row;
  for (const TagPlacement& tag : rig.head_tags) row.push_back(&tag);
  // From the wearer's left to the right, as seen from the front they run the other way.
  std::stable_sort(row.begin(), row.end(), [](const TagPlacement* a, const TagPlacement* b) {
    return a->body_from_tag.translation().x() < b->body_from_tag.translation().x();
  });
  PrintPage page =
      blank(paper, true, "head rig: cut along the solid outlines, fold the tabs back along the dashes");
  page.texts.push_back({margin_mm, margin_mm + header_mm - 3.2, 2.2,
                        "Glue each face, stiffly, where its tab says: from between the eyes, up edge up, "
                        "right and left as the "
                        "wearer has them. 20 mm off do no harm:"});
  page.texts.push_back(
      {margin_mm, margin_mm + header_mm - 0.6, 2.2,
       "head-rig measures where each came to be. No two neighbours in one plane; nothing may "
       "shake."});
  constexpr double tab_mm = 10.0;
  double x = margin_mm + tab_mm, y = margin_mm + header_mm + tab_mm;
  for (std::size_t i = 0; i < row.size(); ++i) {
    const double side = sheet_mm(*row[i]) + 2.0;
    if (side + 2 * tab_mm > page.width_mm - 2 * margin_mm)
      return refused(fmt::format("tag {} fits no page", row[i]->id));
    const bool wraps = x + side + tab_mm > page.width_mm - margin_mm;
    if (wraps) {
      x = margin_mm + tab_mm;
      y += side + 2 * tab_mm + gap_mm;
    }
    if (y + side + tab_mm > page.height_mm - margin_mm - footer_mm) {
      finish(page);
      pages.push_back(std::move(page));
      page = blank(paper, true, "head rig (continued)");
      x = margin_mm + tab_mm;
      y = margin_mm + header_mm + tab_mm;
    }
    if (const Status added = add_tag(page, row[i]->id, x + side / 2, y + side / 2, 1e3 * row[i]->edge_m);
        !added)
      return added;
    // Tabs above and below hold the face to a card.
    page.lines.push_back({x, y, x + side, y, PageLineKind::fold});
    page.lines.push_back({x, y + side, x + side, y + side, PageLineKind::fold});
    outline(page, x + 2, y - tab_mm, side - 4, tab_mm, PageLineKind::cut);
    outline(page, x + 2, y + side, side - 4, tab_mm, PageLineKind::cut);
    page.lines.push_back({x, y, x, y + side, PageLineKind::cut});
    page.lines.push_back({x + side, y, x + side, y + side, PageLineKind::cut});
    double line_mm = y - tab_mm + 4;
    for (const std::string& words : head_place(*row[i])) {
      page.texts.push_back({x + 3, line_mm, 2.2, words});
      line_mm += 3;
    }
    x += side + gap_mm;
  }
  finish(page);
  pages.push_back(std::move(page));
  return {};
}

/// The dark squares of a chessboard in the middle of `page`; returns its upper left corner, mm.
Result<Eigen::Vector2d> add_chessboard(PrintPage& page, const ChessboardShape& shape) {
  const double square = 1e3 * shape.square_m;
  const double width = square * (shape.columns + 1), height = square * (shape.rows + 1);
  const double room_x = page.width_mm - margin_mm, room_y = page.height_mm - 2 * margin_mm - header_mm;
  if (!(shape.columns > 1 && shape.rows > 1 && square > 0 && width <= room_x && height <= room_y))
    return refused(fmt::format("a board of {:.0f} x {:.0f} mm does not fit into {:.0f} x {:.0f} mm", width,
                               height, room_x, room_y));
  const double left = (page.width_mm - width) / 2, top = margin_mm + 5.5;
  for (int row = 0; row <= shape.rows; ++row)
    for (int column = 0; column <= shape.columns; ++column)
      // The inner square at the first corner is dark, see BoardFinder.
      if ((row + column) % 2 == 0)
        page.rectangles.push_back({left + column * square, top + row * square, square, square});
  return Eigen::Vector2d(left, top);
}

Status chessboard(const ChessboardShape& shape, Paper paper, std::vector<PrintPage>& pages) {
  PrintPage page = blank(
      paper, true,
      fmt::format("chessboard, {} x {} inner corners, squares of {:.1f} mm: glue it onto something flat",
                  shape.columns, shape.rows, 1e3 * shape.square_m));
  if (const auto placed = add_chessboard(page, shape); !placed) return placed.error();
  finish(page);
  pages.push_back(std::move(page));
  return {};
}

Status charuco(const CharucoShape& shape, Paper paper, std::vector<PrintPage>& pages) {
  if (const Status good = check_charuco(shape); !good) return good;
  PrintPage page =
      blank(paper, true,
            fmt::format("ChArUco board, {} x {} inner corners, squares of {:.1f} mm, markers of {:.2f} mm",
                        shape.corners.columns, shape.corners.rows, 1e3 * shape.corners.square_m,
                        1e3 * shape.marker_m));
  const auto corner = add_chessboard(page, shape.corners);
  if (!corner) return corner.error();
  const double square = 1e3 * shape.corners.square_m, rim = 0.5 * (square - 1e3 * shape.marker_m);
  for (const CharucoMarker& marker : charuco_markers(shape)) {
    const double cell = 1e3 * shape.marker_m / static_cast<double>(marker.dark.size());
    add_dark_cells(page, marker.dark, corner->x() + marker.column * square + rim,
                   corner->y() + marker.row * square + rim, cell);
  }
  finish(page);
  pages.push_back(std::move(page));
  return {};
}

/// BT.601 full range, as JPEG has it.
PageRectangle swatch(const FingertipColour& colour, double x, double y, double width, double height) {
  const auto part = [](double value) { return std::clamp(value / 255.0, 0.0, 1.0); };
  const double cb = colour.cb - 128, cr = colour.cr - 128;
  return {x,
          y,
          width,
          height,
          part(colour.y + 1.402 * cr),
          part(colour.y - 0.344136 * cb - 0.714136 * cr),
          part(colour.y + 1.772 * cb)};
}

void colour_chart(const Rig& rig, Paper paper, std::vector<PrintPage>& pages) {
  PrintPage page = blank(paper, false, "colours of the fingertips");
  const double height = 36.0, width = page.width_mm - 2 * margin_mm - 70;
  double y = margin_mm + header_mm;
  for (const FingertipColour& colour : rig.colours) {
    page.rectangles.push_back(swatch(colour, margin_mm, y, width, height));
    page.texts.push_back(
        {margin_mm + width + 5, y + 12, 5.0, finger_words[static_cast<std::size_t>(colour.finger)]});
    page.texts.push_back({margin_mm + width + 5, y + 20, 3.0,
                          fmt::format("Y {:.0f}  Cb {:.0f}  Cr {:.0f}", colour.y, colour.cb, colour.cr)});
    y += height + 4;
  }
  page.texts.push_back(
      {margin_mm, y + 4, 3.2,
       "Choose matte caps or paint of about these colours; none of skin, wood, glove or sleeve."});
  page.texts.push_back(
      {margin_mm, y + 9, 3.2,
       "Printers differ: handloft-calibrate colours measures what each camera really sees."});
  finish(page);
  pages.push_back(std::move(page));
}

/// `cairo` scaled to millimetres.
void draw(cairo_t* pen, const PrintPage& page) {
  for (const PageRectangle& r : page.rectangles) {
    cairo_set_source_rgb(pen, r.red, r.green, r.blue);
    cairo_rectangle(pen, r.x_mm, r.y_mm, r.width_mm, r.height_mm);
    cairo_fill(pen);
  }
  for (const PageLine& line : page.lines) {
    const double dashes[] = {2.0, 1.5};
    cairo_set_dash(pen, dashes, line.kind == PageLineKind::fold ? 2 : 0, 0);
    const double grey = line.kind == PageLineKind::solid ? 0.0 : 0.55;
    cairo_set_source_rgb(pen, grey, grey, grey);
    cairo_set_line_width(pen, 0.15);
    cairo_move_to(pen, line.from_x_mm, line.from_y_mm);
    cairo_line_to(pen, line.to_x_mm, line.to_y_mm);
    cairo_stroke(pen);
  }
  cairo_select_font_face(pen, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_source_rgb(pen, 0, 0, 0);
  for (const PageText& text : page.texts) {
    cairo_set_font_size(pen, text.size_mm);
    cairo_move_to(pen, text.x_mm, text.y_mm);
    cairo_show_text(pen, text.words.c_str());
  }
}

}  // namespace

Result<std::vector<PrintPage>> lay_out_pages(const Rig& rig, const PrintOptions& options) {
  std::vector<PrintPage> pages;
  const Status table =
      options.table == TablePrint::one_sheet ? poster(rig, pages) : table_cards(rig, options.paper, pages);
  if (!table) return table.error();
  if (const Status head = head_fold_out(rig, options.paper, pages); !head) return head.error();
  if (const Status board = chessboard(options.chessboard, options.paper, pages); !board) return board.error();
  if (const Status board = charuco(options.charuco, options.paper, pages); !board) return board.error();
  colour_chart(rig, options.paper, pages);
  return pages;
}

Status write_pdf(const std::vector<PrintPage>& pages, const std::filesystem::path& path) {
  cairo_surface_t* surface = cairo_pdf_surface_create(path.c_str(), 595, 842);
  cairo_pdf_surface_set_metadata(surface, CAIRO_PDF_METADATA_TITLE, "Handloft: tags, chessboard, colours");
  for (const PrintPage& page : pages) {
    cairo_pdf_surface_set_size(surface, page.width_mm * points_per_mm, page.height_mm * points_per_mm);
    cairo_t* pen = cairo_create(surface);
    cairo_scale(pen, points_per_mm, points_per_mm);
    draw(pen, page);
    cairo_show_page(pen);
    cairo_destroy(pen);
  }
  cairo_surface_finish(surface);
  const cairo_status_t status = cairo_surface_status(surface);
  cairo_surface_destroy(surface);
  if (status == CAIRO_STATUS_SUCCESS) return {};
  return make_error(ErrorCode::io, fmt::format("could not write the PDF: {}", cairo_status_to_string(status)),
                    path.string());
}

Result<Plane> rasterise(const PrintPage& page, double dots_per_mm) {
  const double width = std::round(page.width_mm * dots_per_mm),
               height = std::round(page.height_mm * dots_per_mm);
  constexpr double largest = 16384;
  if (!(dots_per_mm >= 1 && dots_per_mm <= 40 && width <= largest && height <= largest))
    return refused(fmt::format("found {} dots per mm, expected 1 to 40 and at most {} dots a side",
                               dots_per_mm, largest));
  cairo_surface_t* surface =
      cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(width), static_cast<int>(height));
  cairo_t* pen = cairo_create(surface);
  cairo_set_source_rgb(pen, 1, 1, 1);
  cairo_paint(pen);
  cairo_scale(pen, dots_per_mm, dots_per_mm);
  draw(pen, page);
  cairo_destroy(pen);
  cairo_surface_flush(surface);
  Plane plane;
  plane.width_px = static_cast<int>(width);
  plane.height_px = static_cast<int>(height);
  const unsigned char* data = cairo_image_surface_get_data(surface);
  const int stride = cairo_image_surface_get_stride(surface);
  for (int y = 0; data != nullptr && y < plane.height_px; ++y)
    for (int x = 0; x < plane.width_px; ++x) {
      const unsigned char* p =
          data + static_cast<std::ptrdiff_t>(y) * stride + static_cast<std::ptrdiff_t>(x) * 4;
      plane.samples.push_back(static_cast<std::uint8_t>((29 * p[0] + 150 * p[1] + 77 * p[2] + 128) / 256));
    }
  cairo_surface_destroy(surface);
  if (plane.empty()) return make_error(ErrorCode::internal, "cairo gave no picture", "print");
  return plane;
}

}  // namespace handloft::tracking
