#include "daemon-tracking/calibration/picture.h"

#include <cairo.h>
#include <fmt/format.h>
#include <turbojpeg.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <numbers>

#include "daemon-tracking/vision/camera_model.h"

namespace handloft::tracking {
namespace {

constexpr std::uintmax_t largest_file_bytes = 64u << 20;

struct Surface {
  cairo_surface_t* surface;
  explicit Surface(cairo_surface_t* made) : surface(made) {}
  ~Surface() { cairo_surface_destroy(surface); }
  Surface(const Surface&) = delete;
  Surface& operator=(const Surface&) = delete;
};

Result<CameraFrame> png_frame(const std::filesystem::path& path) {
  const Surface png(cairo_image_surface_create_from_png(path.c_str()));
  if (cairo_surface_status(png.surface) != CAIRO_STATUS_SUCCESS)
    return make_error(ErrorCode::data_corrupt, cairo_status_to_string(cairo_surface_status(png.surface)),
                      path.string());
  const int width = cairo_image_surface_get_width(png.surface),
            height = cairo_image_surface_get_height(png.surface);
  if (width < 1 || height < 1 || width > max_image_side_px || height > max_image_side_px)
    return make_error(ErrorCode::unsupported, fmt::format("found {} x {} pixels", width, height),
                      path.string());
  // Drawn anew, so that every kind of PNG comes as one kind of pixels.
  const Surface plain(cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height));
  cairo_t* pen = cairo_create(plain.surface);
  cairo_set_source_surface(pen, png.surface, 0, 0);
  cairo_paint(pen);
  cairo_destroy(pen);
  cairo_surface_flush(plain.surface);
  std::vector<std::uint8_t> grey;
  grey.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const unsigned char* data = cairo_image_surface_get_data(plain.surface);
  const int stride = cairo_image_surface_get_stride(plain.surface);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const unsigned char* pixel =
          data + static_cast<std::ptrdiff_t>(y) * stride + static_cast<std::ptrdiff_t>(x) * 4;
      grey.push_back(static_cast<std::uint8_t>((29 * pixel[0] + 150 * pixel[1] + 77 * pixel[2] + 128) / 256));
    }
  }
  CameraFrame frame;
  frame.format = PixelFormat::grey;
  frame.width_px = width;
  frame.height_px = height;
  frame.bytes = std::make_shared<const std::vector<std::uint8_t>>(std::move(grey));
  return frame;
}

}  // namespace

struct Picture::Canvas {
  cairo_surface_t* surface = nullptr;
  cairo_t* pen = nullptr;

  Canvas(int width, int height)
      : surface(cairo_image_surface_create(CAIRO_FORMAT_RGB24, std::clamp(width, 1, max_image_side_px),
                                           std::clamp(height, 1, max_image_side_px))),
        pen(cairo_create(surface)) {
    cairo_translate(pen, 0.5, 0.5);  // Pixel centres at whole numbers.
    cairo_select_font_face(pen, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  }
  ~Canvas() {
    cairo_destroy(pen);
    cairo_surface_destroy(surface);
  }
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;
  void use(const Ink& ink) const { cairo_set_source_rgba(pen, ink.red, ink.green, ink.blue, ink.alpha); }
};

Picture::Picture(int width_px, int height_px, Ink background)
    : canvas_(std::make_unique<Canvas>(width_px, height_px)) {
  canvas_->use(background);
  cairo_paint(canvas_->pen);
}

Picture::Picture(const Plane& luma) : Picture(luma.width_px, luma.height_px, ink::black) {
  if (luma.width_px != this->width_px() || luma.height_px != this->height_px() || luma.empty()) return;
  unsigned char* data = cairo_image_surface_get_data(canvas_->surface);
  if (data == nullptr) return;
  const int stride = cairo_image_surface_get_stride(canvas_->surface);
  for (int y = 0; y < luma.height_px; ++y)
    for (int x = 0; x < luma.width_px; ++x)
      std::fill_n(data + static_cast<std::ptrdiff_t>(y) * stride + static_cast<std::ptrdiff_t>(x) * 4, 3,
                  luma.at(x, y));
  cairo_surface_mark_dirty(canvas_->surface);
}

Picture::~Picture() = default;
Picture::Picture(Picture&&) noexcept = default;
Picture& Picture::operator=(Picture&&) noexcept = default;

int Picture::width_px() const {
  return cairo_image_surface_get_width(canvas_->surface);
}
int Picture::height_px() const {
  return cairo_image_surface_get_height(canvas_->surface);
}

void Picture::circle(const Eigen::Vector2d& centre, double radius_px, const Ink& colour) {
  if (!centre.allFinite()) return;
  canvas_->use(colour);
  cairo_set_line_width(canvas_->pen, 1.2);
  cairo_new_path(canvas_->pen);
  cairo_arc(canvas_->pen, centre.x(), centre.y(), radius_px, 0, 2 * std::numbers::pi);
  cairo_stroke(canvas_->pen);
}

void Picture::line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, const Ink& colour,
                   double width_px) {
  if (!from.allFinite() || !to.allFinite()) return;
  canvas_->use(colour);
  cairo_set_line_width(canvas_->pen, width_px);
  cairo_move_to(canvas_->pen, from.x(), from.y());
  cairo_line_to(canvas_->pen, to.x(), to.y());
  cairo_stroke(canvas_->pen);
}

void Picture::fill(const Eigen::Vector2d& corner, const Eigen::Vector2d& size, const Ink& colour) {
  canvas_->use(colour);
  cairo_rectangle(canvas_->pen, corner.x(), corner.y(), size.x(), size.y());
  cairo_fill(canvas_->pen);
}

void Picture::text(const Eigen::Vector2d& at, std::string_view words, const Ink& colour, double size_px) {
  const std::string terminated(words);
  cairo_set_font_size(canvas_->pen, size_px);
  // A dark rim keeps it readable on any picture.
  canvas_->use(ink::black);
  cairo_move_to(canvas_->pen, at.x() + 1, at.y() + 1);
  cairo_show_text(canvas_->pen, terminated.c_str());
  canvas_->use(colour);
  cairo_move_to(canvas_->pen, at.x(), at.y());
  cairo_show_text(canvas_->pen, terminated.c_str());
}

Status Picture::save(const std::filesystem::path& path) const {
  const cairo_status_t status = cairo_surface_write_to_png(canvas_->surface, path.c_str());
  if (status == CAIRO_STATUS_SUCCESS) return {};
  return make_error(ErrorCode::io,
                    fmt::format("could not write the picture: {}", cairo_status_to_string(status)),
                    path.string());
}

Result<CameraFrame> read_picture(const std::filesystem::path& path) {
  std::error_code problem;
  const std::uintmax_t size = std::filesystem::file_size(path, problem);
  if (problem) return make_error(ErrorCode::not_found, problem.message(), path.string());
  if (size > largest_file_bytes)
    return make_error(ErrorCode::resource_exhausted, "the picture is too large", path.string());
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension == ".png") return png_frame(path);
  if (extension != ".jpg" && extension != ".jpeg")
    return make_error(ErrorCode::unsupported, "expected a JPEG or PNG file", path.string());
  std::ifstream in(path, std::ios::binary);
  std::vector<std::uint8_t> bytes((std::istreambuf_iterator<char>(in)), {});
  if (in.bad() || bytes.empty())
    return make_error(ErrorCode::io, "could not read the picture", path.string());
  CameraFrame frame;
  const tjhandle handle = tjInitDecompress();
  int sampling = 0, colours = 0;
  const int bad = tjDecompressHeader3(handle, bytes.data(), static_cast<unsigned long>(bytes.size()),
                                      &frame.width_px, &frame.height_px, &sampling, &colours);
  tjDestroy(handle);
  if (bad != 0) return make_error(ErrorCode::data_corrupt, "it is no JPEG", path.string());
  frame.format = PixelFormat::mjpeg;
  frame.bytes = std::make_shared<const std::vector<std::uint8_t>>(std::move(bytes));
  return frame;
}

}  // namespace handloft::tracking
