#include "client-hmd/view/hmd_calibration.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <glm/gtc/constants.hpp>
#include <set>

namespace handloft::client {
namespace {

constexpr std::size_t max_file_bytes = 64U << 10;
constexpr int longest_screen_side_px = 16384;
constexpr double shortest_ipd_m =
    0.04;  ///< People's lie between 51 and 77 mm; lenses of toys go a bit beyond.
constexpr double longest_ipd_m = 0.09;
constexpr double farthest_eye_m = 0.2;  ///< From the head's middle.
constexpr double widest_half_field_deg = 80.0;
constexpr double largest_coefficient = 100.0;

struct Range {
  double min = 0.0;
  double max = 0.0;
};

double radians(double degrees) {
  return degrees * glm::pi<double>() / 180.0;
}

/// Reads the fields of one table; remembers the first that is wrong and which ones it knows.
class Fields {
 public:
  Fields(const toml::table* table, std::string prefix, std::string file)
      : table_(table), prefix_(std::move(prefix)), file_(std::move(file)) {}

  bool has(std::string_view name) const { return table_ != nullptr && table_->get(name) != nullptr; }

  std::string text(const std::string& name) {
    const toml::node* node = find(name, "a text");
    if (node == nullptr) return {};
    const auto value = node->value_exact<std::string>();
    if (!value || value->size() > 256) {
      fail(name, "expected a text of at most 256 bytes");
      return {};
    }
    return *value;
  }
  double number(const std::string& name, const Range& range) {
    const toml::node* node = find(name, fmt::format("a number within {}..{}", range.min, range.max));
    return node == nullptr ? 0.0 : checked(name, *node, range);
  }
  int whole(const std::string& name, const Range& range) {
    const double value = number(name, range);
    if (value != std::floor(value)) fail(name, fmt::format("found {}, expected a whole number", value));
    return status_ ? static_cast<int>(value) : 0;
  }
  template <std::size_t count>
  std::array<double, count> numbers(const std::string& name, const Range& range) {
    std::array<double, count> values{};
    const toml::node* node = find(name, fmt::format("{} numbers within {}..{}", count, range.min, range.max));
    if (node == nullptr) return values;
    const toml::array* array = node->as_array();
    if (array == nullptr || array->size() != count) {
      fail(name, fmt::format("expected a list of {} numbers", count));
      return values;
    }
    for (std::size_t i = 0; i < count; ++i) {
      values[i] = checked(fmt::format("{}[{}]", name, i), *array->get(i), range);
    }
    return values;
  }
  Fields table(const std::string& name) {
    const toml::node* node = find(name, "a table");
    if (node != nullptr && node->as_table() == nullptr) fail(name, "expected a table");
    Fields inner(node == nullptr ? nullptr : node->as_table(), prefix_ + name + ".", file_);
    inner.status_ = status_;
    return inner;
  }
  void fail(const std::string& name, const std::string& message) {
    if (!status_) return;
    status_ = make_error(ErrorCode::invalid_argument, message, fmt::format("{}: {}{}", file_, prefix_, name));
  }
  void take(const Fields& inner) {
    if (status_) status_ = inner.status_;
  }
  /// After everything was read.
  Status finish() {
    if (table_ == nullptr) return status_;
    for (const auto& [key, node] : *table_) {
      if (!known_.contains(std::string(key.str()))) fail(std::string(key.str()), "is not a field");
    }
    return status_;
  }
  const Status& status() const { return status_; }

 private:
  const toml::node* find(const std::string& name, const std::string& expected) {
    known_.insert(name);
    const toml::node* node = table_ == nullptr ? nullptr : table_->get(name);
    if (node == nullptr) fail(name, "is missing, expected " + expected);
    return node;
  }
  double checked(const std::string& name, const toml::node& node, const Range& range) {
    const std::optional<double> value = node.is_number() ? node.value<double>() : std::nullopt;
    if (value && std::isfinite(*value) && *value >= range.min && *value <= range.max) return *value;
    fail(name,
         fmt::format("{}, expected a number within {}..{}",
                     value ? fmt::format("found {}", *value) : "found no number", range.min, range.max));
    return 0.0;
  }

  const toml::table* table_;
  std::string prefix_;
  std::string file_;
  std::set<std::string> known_;
  Status status_;
};

RigidPose read_pose(Fields& fields, double beside_m) {
  RigidPose pose{{beside_m, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}};
  if (fields.has("position_m")) {
    const auto [x, y, z] = fields.numbers<3>("position_m", {-farthest_eye_m, farthest_eye_m});
    pose.position = {x, y, z};
  }
  if (fields.has("turned_deg")) {
    // About up, then right, then ahead: how far a panel is turned outwards, raised and tilted.
    const auto [yaw, pitch, roll] = fields.numbers<3>("turned_deg", {-60.0, 60.0});
    pose.orientation = glm::angleAxis(radians(yaw), glm::dvec3(0, 1, 0)) *
                       glm::angleAxis(radians(pitch), glm::dvec3(1, 0, 0)) *
                       glm::angleAxis(radians(roll), glm::dvec3(0, 0, 1));
  }
  return pose;
}

/// A lens shows more the farther out one looks; otherwise its inverse is none.
bool widens(const EyeCalibration& eye, const RadialPolynomial& k) {
  constexpr int samples = 256;
  double farthest = 0.0;
  for (const double x : {-0.5, eye.area.width_px - 0.5}) {
    for (const double y : {-0.5, eye.area.height_px - 0.5}) {
      farthest = std::max(farthest, glm::length(glm::dvec2(x, y) - eye.lens_centre_px));
    }
  }
  farthest /= eye.unit_radius_px;
  double last = 0.0;
  for (int i = 1; i <= samples; ++i) {
    const double r = farthest * i / samples;
    const double r2 = r * r;
    const double now = r * (k[0] + r2 * (k[1] + r2 * (k[2] + r2 * k[3])));
    if (!(now > last)) return false;
    last = now;
  }
  return true;
}

EyeCalibration read_eye(Fields& fields, const HmdCalibration& screen, double beside_m) {
  EyeCalibration eye;
  const auto area = fields.numbers<4>("area_px", {0.0, longest_screen_side_px});
  eye.area = {static_cast<int>(area[0]), static_cast<int>(area[1]), static_cast<int>(area[2]),
              static_cast<int>(area[3])};
  if (eye.area.width_px < 1 || eye.area.height_px < 1 ||
      eye.area.x_px + eye.area.width_px > screen.width_px ||
      eye.area.y_px + eye.area.height_px > screen.height_px) {
    fields.fail("area_px", "expected x, y, width, height within the screen");
  }
  const Range angle{1.0, widest_half_field_deg};
  Fields field = fields.table("field_of_view_deg");
  eye.field_of_view.up_rad = radians(field.number("up", angle));
  eye.field_of_view.down_rad = radians(field.number("down", angle));
  eye.field_of_view.left_rad = radians(field.number("left", angle));
  eye.field_of_view.right_rad = radians(field.number("right", angle));
  (void)field.finish();
  fields.take(field);
  const auto [x, y] =
      fields.numbers<2>("lens_centre_px", {-1.0 * longest_screen_side_px, longest_screen_side_px});
  eye.lens_centre_px = {x, y};
  eye.unit_radius_px = fields.number("unit_radius_px", {1.0, longest_screen_side_px});
  eye.tangent_per_unit = fields.number("tangent_per_unit", {1e-3, largest_coefficient});
  const Range coefficient{-largest_coefficient, largest_coefficient};
  constexpr std::array names{"distortion_red", "distortion_green", "distortion_blue"};
  for (std::size_t i = 0; i < channel_count; ++i) {
    eye.distortion[i] = fields.numbers<4>(names[i], coefficient);
    if (fields.status() && !widens(eye, eye.distortion[i])) {
      fields.fail(names[i], "expected a lens whose picture widens all the way to the area's corners");
    }
  }
  eye.head_from_eye = read_pose(fields, beside_m);
  (void)fields.finish();
  return eye;
}

bool overlap(const PixelArea& a, const PixelArea& b) {
  return a.x_px < b.x_px + b.width_px && b.x_px < a.x_px + a.width_px && a.y_px < b.y_px + b.height_px &&
         b.y_px < a.y_px + a.height_px;
}

}  // namespace

HmdCalibration default_hmd_calibration() {
  constexpr int eye_width_px = 960;
  constexpr int eye_height_px = 1080;
  HmdCalibration hmd;
  hmd.name = "Two plain halves";
  hmd.width_px = 2 * eye_width_px;
  hmd.height_px = eye_height_px;
  hmd.interpupillary_distance_m = 0.063;
  for (std::size_t i = 0; i < 2; ++i) {
    EyeCalibration& eye = hmd.eyes[i];
    eye.area = {static_cast<int>(i) * eye_width_px, 0, eye_width_px, eye_height_px};
    eye.lens_centre_px = {(eye_width_px - 1) / 2.0, (eye_height_px - 1) / 2.0};
    eye.unit_radius_px = eye_height_px / 2.0;  // At 45 degrees.
    eye.head_from_eye.position.x = (i == 0 ? -0.5 : 0.5) * hmd.interpupillary_distance_m;
  }
  return hmd;
}

Result<HmdCalibration> parse_hmd_calibration(std::string_view text, const std::string& file_name) {
  if (text.size() > max_file_bytes) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found {} bytes, expected at most {}", text.size(), max_file_bytes),
                      file_name);
  }
  toml::table root;
  try {
    root = toml::parse(text, file_name);
  } catch (const toml::parse_error& error) {
    return make_error(ErrorCode::invalid_argument, std::string(error.description()),
                      fmt::format("{}:{}", file_name, error.source().begin.line));
  }
  Fields fields(&root, "", file_name);
  HmdCalibration hmd;
  hmd.name = fields.text("name");
  const Range side{2.0, longest_screen_side_px};
  Fields screen = fields.table("screen");
  hmd.width_px = screen.whole("width_px", side);
  hmd.height_px = screen.whole("height_px", side);
  hmd.refresh_hz = screen.number("refresh_hz", {10.0, 1000.0});
  (void)screen.finish();
  fields.take(screen);
  hmd.interpupillary_distance_m = fields.number("interpupillary_distance_m", {shortest_ipd_m, longest_ipd_m});
  const double half_m = 0.5 * hmd.interpupillary_distance_m;
  Fields left = fields.table("left");
  hmd.eyes[0] = read_eye(left, hmd, -half_m);
  fields.take(left);
  Fields right = fields.table("right");
  hmd.eyes[1] = read_eye(right, hmd, half_m);
  fields.take(right);
  if (overlap(hmd.eyes[0].area, hmd.eyes[1].area)) {
    fields.fail("right.area_px", "expected another part of the screen than left.area_px");
  }
  if (const Status status = fields.finish(); !status) return status.error();
  return hmd;
}

Result<HmdCalibration> read_hmd_calibration(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return make_error(ErrorCode::not_found, "cannot be opened", path);
  std::string text(max_file_bytes + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (file.bad()) return make_error(ErrorCode::io, "cannot be read", path);
  text.resize(static_cast<std::size_t>(file.gcount()));
  return parse_hmd_calibration(text, path);
}

HmdCalibration scaled_to(const HmdCalibration& calibration, int width_px, int height_px) {
  HmdCalibration out = calibration;
  const double scale = std::min(static_cast<double>(width_px) / calibration.width_px,
                                static_cast<double>(height_px) / calibration.height_px);
  const double left = 0.5 * (width_px - scale * calibration.width_px);
  const double top = 0.5 * (height_px - scale * calibration.height_px);
  out.width_px = width_px;
  out.height_px = height_px;
  for (EyeCalibration& eye : out.eyes) {
    const PixelArea from = eye.area;
    // Edges are rounded, not sizes, so that neighbours stay neighbours.
    const auto edge = [scale](double offset, int at, int limit) {
      return std::clamp(static_cast<int>(std::lround(offset + scale * at)), 0, limit);
    };
    eye.area.x_px = std::min(edge(left, from.x_px, width_px), width_px - 1);
    eye.area.y_px = std::min(edge(top, from.y_px, height_px), height_px - 1);
    eye.area.width_px = std::max(1, edge(left, from.x_px + from.width_px, width_px) - eye.area.x_px);
    eye.area.height_px = std::max(1, edge(top, from.y_px + from.height_px, height_px) - eye.area.y_px);
    const glm::dvec2 corner(left + scale * from.x_px - eye.area.x_px,
                            top + scale * from.y_px - eye.area.y_px);
    eye.lens_centre_px = corner + scale * (eye.lens_centre_px + 0.5) - 0.5;
    eye.unit_radius_px *= scale;
  }
  return out;
}

}  // namespace handloft::client
