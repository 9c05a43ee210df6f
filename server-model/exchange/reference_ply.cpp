// PLY, as text and in both byte orders: x, y and z of the element "vertex", the list "vertex_indices" (or
// "vertex_index") of the element "face"; all other properties are read over.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "server-model/exchange/raw_triangles.h"
#include "server-model/exchange/reference_text.h"

namespace handloft::exchange::detail {
namespace {

struct Type {
  std::size_t bytes = 0;
  bool real = false;
  bool negative = false;  ///< May be.
};

struct Property {
  std::string_view name;
  std::optional<Type> count;  ///< Of a list's length.
  Type type;
};

struct Element {
  std::string_view name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

enum class Encoding { text, little_endian, big_endian };

struct Header {
  Encoding encoding = Encoding::text;
  std::vector<Element> elements;
};

Error corrupt(std::string message) {
  return make_error(ErrorCode::data_corrupt, std::move(message), "path");
}

std::optional<Type> to_type(std::string_view name) {
  using Named = std::pair<std::string_view, Type>;
  constexpr std::array<Named, 16> types{{{"char", {1, false, true}},
                                         {"int8", {1, false, true}},
                                         {"uchar", {1, false, false}},
                                         {"uint8", {1, false, false}},
                                         {"short", {2, false, true}},
                                         {"int16", {2, false, true}},
                                         {"ushort", {2, false, false}},
                                         {"uint16", {2, false, false}},
                                         {"int", {4, false, true}},
                                         {"int32", {4, false, true}},
                                         {"uint", {4, false, false}},
                                         {"uint32", {4, false, false}},
                                         {"float", {4, true, true}},
                                         {"float32", {4, true, true}},
                                         {"double", {8, true, true}},
                                         {"float64", {8, true, true}}}};
  const auto found =
      std::find_if(types.begin(), types.end(), [&](const Named& each) { return each.first == name; });
  return found == types.end() ? std::nullopt : std::optional(found->second);
}

/// Whatever encoding: the next number of the body.
class Body {
 public:
  Body(std::span<const std::byte> bytes, Encoding encoding)
      : bytes_(bytes), text_(as_text(bytes)), encoding_(encoding) {}

  std::optional<double> next(const Type& type) {
    if (encoding_ == Encoding::text) return to_number<double>(take_word(text_));
    if (type.bytes == 0 || bytes_.size() < type.bytes) return std::nullopt;
    std::uint64_t bits = 0;
    for (std::size_t k = 0; k < type.bytes; ++k) {
      const std::size_t place = encoding_ == Encoding::little_endian ? k : type.bytes - 1 - k;
      bits |= std::to_integer<std::uint64_t>(bytes_[k]) << (8U * place);
    }
    bytes_ = bytes_.subspan(type.bytes);
    if (type.real) {
      return type.bytes == 8 ? std::bit_cast<double>(bits)
                             : static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
    }
    const std::uint64_t sign = std::uint64_t{1} << (8U * type.bytes - 1U);
    if (type.negative && (bits & sign) != 0)
      return static_cast<double>(bits) - 2.0 * static_cast<double>(sign);
    return static_cast<double>(bits);
  }

  /// How many numbers may still come.
  std::size_t left() const { return encoding_ == Encoding::text ? text_.size() : bytes_.size(); }

 private:
  std::span<const std::byte> bytes_;
  std::string_view text_;
  Encoding encoding_;
};

Result<Header> read_header(std::string_view& text) {
  if (take_line(text) != "ply") return corrupt("found no \"ply\" in the first line, expected a PLY file");
  constexpr int max_lines = 1000;
  Header header;
  for (int i = 0; i < max_lines && !text.empty(); ++i) {
    std::string_view line = take_line(text);
    const std::string_view keyword = take_word(line);
    if (keyword == "end_header") return header;
    if (keyword == "format") {
      const std::string_view name = take_word(line);
      if (name != "ascii" && name != "binary_little_endian" && name != "binary_big_endian") {
        return corrupt("found a format that is neither ascii nor binary");
      }
      header.encoding =
          name == "ascii" ? Encoding::text
                          : (name == "binary_little_endian" ? Encoding::little_endian : Encoding::big_endian);
    } else if (keyword == "element") {
      Element element;
      element.name = take_word(line);
      const auto count = to_number<std::uint32_t>(take_word(line));
      if (!count) return corrupt("found an element without a count");
      element.count = *count;
      header.elements.push_back(std::move(element));
    } else if (keyword == "property") {
      Property property;
      std::string_view type = take_word(line);
      if (type == "list") {
        property.count = to_type(take_word(line));
        if (!property.count || property.count->real) return corrupt("found a list without a whole count");
        type = take_word(line);
      }
      const auto known = to_type(type);
      if (!known || header.elements.empty()) return corrupt("found a property of no type or no element");
      property.type = *known;
      property.name = take_word(line);
      header.elements.back().properties.push_back(property);
    }
  }
  return corrupt("the header does not end");
}

/// A whole number from 0 to below `limit`.
std::optional<std::uint32_t> to_index(double value, std::size_t limit) {
  if (!(value >= 0 && value < static_cast<double>(limit)) || value != std::floor(value)) return std::nullopt;
  return static_cast<std::uint32_t>(value);
}

Status read_vertices(Body& body, const Element& element, RawTriangles& into) {
  for (std::uint64_t i = 0; i < element.count; ++i) {
    geometry::Vec3 p = geometry::Vec3::Zero();
    int found = 0;
    for (const Property& property : element.properties) {
      if (property.count) return corrupt("found a list at a vertex, expected x, y and z");
      const auto value = body.next(property.type);
      if (!value) return corrupt(fmt::format("the file ends, or is no number, at vertex {}", i));
      constexpr std::string_view axes = "xyz";
      const std::size_t axis =
          property.name.size() == 1 ? axes.find(property.name[0]) : std::string_view::npos;
      if (axis == std::string_view::npos) continue;
      p[static_cast<int>(axis)] = *value;
      found |= 1 << axis;
    }
    constexpr int all = 7;
    if (found != all) return corrupt("the vertices have no x, y and z");
    into.positions.push_back(p);
  }
  return {};
}

Status read_others(Body& body, const Element& element, RawTriangles* into, const ReferenceOptions& options) {
  constexpr std::size_t max_list = 10000;
  std::vector<std::uint32_t> corners;
  for (std::uint64_t i = 0; i < element.count; ++i) {
    for (const Property& property : element.properties) {
      std::uint32_t count = 1;
      if (property.count) {
        const auto length = body.next(*property.count);
        const auto whole = length ? to_index(*length, max_list) : std::nullopt;
        if (!whole)
          return corrupt(fmt::format("{} {} has a list that is cut off or too long", element.name, i));
        count = *whole;
      }
      const bool faces = into != nullptr && property.count &&
                         (property.name == "vertex_indices" || property.name == "vertex_index");
      corners.clear();
      for (std::uint32_t k = 0; k < count; ++k) {
        const auto value = body.next(property.type);
        if (!value) return corrupt(fmt::format("the file ends, or is no number, at {} {}", element.name, i));
        if (!faces) continue;
        const auto corner = to_index(*value, into->positions.size());
        if (!corner) {
          return corrupt(fmt::format("face {} names a vertex that is not there, expected below {}", i,
                                     into->positions.size()));
        }
        corners.push_back(*corner);
      }
      if (!faces) continue;
      if (corners.size() >= 3) append_polygon(corners, *into);
      if (Status status = check_counts(0, into->indices.size() / 3, options); !status) return status;
    }
  }
  return {};
}

}  // namespace

Result<RawTriangles> read_ply(std::span<const std::byte> content, const ReferenceOptions& options) {
  std::string_view rest = as_text(content);
  const auto header = read_header(rest);
  if (!header) return header.error();
  Body body(content.last(rest.size()), header->encoding);
  RawTriangles result;
  for (const Element& element : header->elements) {
    // Each takes a byte at least, so a count cannot promise what is not there.
    if (element.count > 0 && (element.properties.empty() || element.count > body.left())) {
      return corrupt(fmt::format("the header promises {} of \"{}\", but {} bytes follow", element.count,
                                 element.name.substr(0, 64), body.left()));
    }
    const bool vertices = element.name == "vertex";
    const bool faces = element.name == "face";
    if (Status status = check_counts(vertices ? element.count : 0, faces ? element.count : 0, options);
        !status) {
      return status.error();
    }
    const Status status = vertices ? read_vertices(body, element, result)
                                   : read_others(body, element, faces ? &result : nullptr, options);
    if (!status) return status.error();
  }
  if (result.indices.empty()) {
    return corrupt(fmt::format("found {} vertices and no face, expected a mesh", result.positions.size()));
  }
  return result;
}

}  // namespace handloft::exchange::detail
