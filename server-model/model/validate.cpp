#include "server-model/model/validate.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>

#include "server-model/geometry/symmetry.h"

namespace handloft::model {

namespace {

// The length of the UTF-8 sequence at text[i], 0 when it is malformed (overlong, surrogate, cut, beyond
// U+10FFFF).
std::size_t utf8_sequence(std::string_view text, std::size_t i) {
  const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(text[k]); };
  const unsigned lead = byte(i);
  if (lead < 0x80) return 1;
  const std::size_t length = lead >= 0xf0 ? 4 : lead >= 0xe0 ? 3 : 2;
  if (lead < 0xc2 || lead > 0xf4 || i + length > text.size()) return 0;
  std::uint32_t code = lead & (0xffU >> (length + 1));
  for (std::size_t k = 1; k < length; ++k) {
    if ((byte(i + k) & 0xc0U) != 0x80U) return 0;
    code = (code << 6U) | (byte(i + k) & 0x3fU);
  }
  const bool overlong = (length == 3 && code < 0x800) || (length == 4 && code < 0x10000);
  const bool surrogate = code >= 0xd800 && code <= 0xdfff;
  return overlong || surrogate || code > 0x10ffff ? 0 : length;
}

/// `controls`: those control characters that may be among them.
Status check_characters(std::string_view text, std::string_view controls, std::string_view field) {
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = utf8_sequence(text, i);
    const auto byte = static_cast<unsigned char>(text[i]);
    const bool control = (byte < 0x20 || byte == 0x7f) && controls.find(text[i]) == std::string_view::npos;
    if (length == 0 || control) {
      return make_error(
          ErrorCode::invalid_argument,
          fmt::format("found the byte 0x{:02x} at {}, expected UTF-8 without control characters",
                      static_cast<unsigned>(byte), i),
          std::string(field));
    }
    i += length;
  }
  return {};
}

}  // namespace

Status check_id(std::string_view id, std::string_view field, const Limits& limits) {
  if (id.empty() || id.size() > limits.max_id_bytes) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found an id of {} characters, expected 1..{}", id.size(), limits.max_id_bytes),
        std::string(field));
  }
  for (const char c : id) {
    const bool good = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                      c == '-' || c == '_' || c == '.';
    if (!good) {
      return make_error(
          ErrorCode::invalid_argument,
          fmt::format("found the byte 0x{:02x} in an id, expected letters, digits, '-', '_' and '.'",
                      static_cast<unsigned>(static_cast<unsigned char>(c))),
          std::string(field));
    }
  }
  return {};
}

Status check_name(std::string_view name, std::string_view field, const Limits& limits) {
  if (name.size() > limits.max_name_bytes) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found a name of {} bytes, expected at most {}", name.size(), limits.max_name_bytes),
        std::string(field));
  }
  return check_characters(name, {}, field);
}

Status check_text(std::string_view text, std::size_t max_bytes, std::string_view field) {
  if (text.size() > max_bytes) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found a text of {} bytes, expected at most {}", text.size(), max_bytes),
                      std::string(field));
  }
  return check_characters(text, "\t\n", field);
}

Status check_coordinate(double value, const std::string& field, const Limits& limits) {
  if (!std::isfinite(value) || std::abs(value) > limits.max_coordinate_m) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found {}, expected a number of metres within +-{}", value, limits.max_coordinate_m),
        field);
  }
  return {};
}

Result<Eigen::Quaterniond> read_rotation(const handloft::v1::Quaternion& rotation, bool present,
                                         const std::string& field) {
  if (!present) return Eigen::Quaterniond::Identity();
  const Eigen::Vector4d numbers(rotation.w(), rotation.x(), rotation.y(), rotation.z());
  if (!numbers.allFinite() || !(numbers.stableNorm() > 0)) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found ({}, {}, {}, {}), expected a finite quaternion that is not 0",
                                  rotation.w(), rotation.x(), rotation.y(), rotation.z()),
                      field);
  }
  const Eigen::Vector4d unit = numbers.stableNormalized();
  return Eigen::Quaterniond(unit[0], unit[1], unit[2], unit[3]);
}

Status check_degree(std::uint32_t degree, std::string_view field, const Limits& limits) {
  if (degree > limits.max_degree) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected a degree of 1..{}, or 0", degree, limits.max_degree),
                      std::string(field));
  }
  return {};
}

Result<EntityPtr> require_entity(const Document& document, std::string_view id, std::string_view field) {
  EntityPtr entity = document.find(id);
  if (!entity) {
    // Ids come from outside: a long or binary one is not echoed.
    const bool printable = check_id(id, {}, Limits{}).ok();
    return make_error(ErrorCode::not_found,
                      printable ? fmt::format("there is no entity \"{}\"", id)
                                : std::string(id.empty() ? "found nothing, expected the id of an entity"
                                                         : "there is no such entity"),
                      std::string(field));
  }
  return entity;
}

Result<DualPtr> require_dual(const Document& document, std::string_view id, std::string_view field) {
  auto entity = require_entity(document, id, field);
  if (!entity) return entity.error();
  DualPtr shape = as_dual(*entity);
  if (!shape) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found \"{}\", a {}, expected a dual shape", id, to_string((*entity)->kind())),
        std::string(field));
  }
  return shape;
}

Result<DualPoint> read_point(const handloft::v1::Point& point, const std::string& field,
                             const Limits& limits) {
  DualPoint result;
  if (!point.has_position()) {
    return make_error(ErrorCode::invalid_argument, "found nothing, expected x, y and z in metres",
                      field + ".position");
  }
  const auto& position = point.position();
  const struct {
    double value;
    const char* name;
    double* to;
  } coordinates[] = {
      {position.x(), "x", &result.x}, {position.y(), "y", &result.y}, {position.z(), "z", &result.z}};
  for (const auto& coordinate : coordinates) {
    if (!std::isfinite(coordinate.value) || std::abs(coordinate.value) > limits.max_coordinate_m) {
      return check_coordinate(coordinate.value, field + ".position." + coordinate.name, limits).error();
    }
    *coordinate.to = coordinate.value;
  }
  if (!(point.pressure() >= 0.0 && point.pressure() <= 1.0)) {
    return make_error(ErrorCode::invalid_argument, fmt::format("found {}, expected 0..1", point.pressure()),
                      field + ".pressure");
  }
  result.pressure = point.pressure();
  result.time_ns = point.time_ns();
  return result;
}

Result<geometry::Vec3> read_vector(const handloft::v1::Vec3& vector, const std::string& field,
                                   const Limits& limits) {
  for (const auto& [value, name] :
       {std::pair{vector.x(), ".x"}, std::pair{vector.y(), ".y"}, std::pair{vector.z(), ".z"}}) {
    if (auto status = check_coordinate(value, field + name, limits); !status) return status.error();
  }
  return geometry::Vec3(vector.x(), vector.y(), vector.z());
}

Result<geometry::Plane> read_plane(const handloft::v1::Plane& plane, const std::string& field,
                                   const Limits& limits) {
  const auto& origin = plane.origin();
  const auto& normal = plane.normal();
  for (const auto& [value, name] : {std::pair{origin.x(), ".origin.x"}, std::pair{origin.y(), ".origin.y"},
                                    std::pair{origin.z(), ".origin.z"}, std::pair{normal.x(), ".normal.x"},
                                    std::pair{normal.y(), ".normal.y"}, std::pair{normal.z(), ".normal.z"}}) {
    if (auto status = check_coordinate(value, field + name, limits); !status) return status.error();
  }
  auto made =
      geometry::make_plane({origin.x(), origin.y(), origin.z()}, {normal.x(), normal.y(), normal.z()});
  if (!made) {
    Error error = made.error();
    error.field = field + ".normal";
    return error;
  }
  return made;
}

}  // namespace handloft::model
