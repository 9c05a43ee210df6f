// Wavefront OBJ: the lines "v" and "f". Everything else (normals, materials, groups, curves) is passed over.

#include <fmt/format.h>

#include <cstdint>
#include <string>

#include "server-model/exchange/raw_triangles.h"
#include "server-model/exchange/reference_text.h"

namespace handloft::exchange::detail {
namespace {

constexpr std::size_t max_corners = 10000;  ///< Of one polygon.

Error corrupt(std::size_t line, std::string_view what) {
  return make_error(ErrorCode::data_corrupt, fmt::format("line {}: {}", line, what), "path");
}

/// "7", "7/1/3" and "-1" (the last vertex so far) as a vertex that exists.
std::optional<std::uint32_t> to_corner(std::string_view word, std::size_t vertices) {
  const auto number = to_number<std::int64_t>(word.substr(0, word.find('/')));
  if (!number) return std::nullopt;
  const auto count = static_cast<std::int64_t>(vertices);
  const std::int64_t index = *number < 0 ? count + *number : *number - 1;
  if (*number == 0 || index < 0 || index >= count) return std::nullopt;
  return static_cast<std::uint32_t>(index);
}

}  // namespace

Result<RawTriangles> read_obj(std::span<const std::byte> content, const ReferenceOptions& options) {
  RawTriangles result;
  std::string_view text = as_text(content);
  std::vector<std::uint32_t> corners;
  std::string joined;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::size_t first = number;
    std::string_view line = take_line(text);
    if (!line.empty() && line.back() == '\\') {  // Goes on in the next line.
      joined = line.substr(0, line.size() - 1);
      while (!text.empty()) {
        const std::string_view more = take_line(text);
        ++number;
        const bool goes_on = !more.empty() && more.back() == '\\';
        joined += ' ';
        joined += more.substr(0, more.size() - (goes_on ? 1U : 0U));
        if (!goes_on) break;
      }
      line = joined;
    }
    line = line.substr(0, line.find('#'));
    const std::string_view keyword = take_word(line);
    if (keyword == "v") {
      geometry::Vec3 p;
      for (int axis = 0; axis < 3; ++axis) {
        const auto value = to_number<double>(take_word(line));
        if (!value) return corrupt(first, "found a vertex that is not three numbers");
        p[axis] = *value;
      }
      result.positions.push_back(p);
    } else if (keyword == "f") {
      corners.clear();
      for (std::string_view word = take_word(line); !word.empty(); word = take_word(line)) {
        const auto corner = to_corner(word, result.positions.size());
        if (!corner || corners.size() == max_corners) {
          return corrupt(
              first, fmt::format("a face has a corner that is none of the {} vertices so far, or has more "
                                 "than {}",
                                 result.positions.size(), max_corners));
        }
        corners.push_back(*corner);
      }
      if (corners.size() < 3) return corrupt(first, "found a face of fewer than three corners");
      append_polygon(corners, result);
    } else {
      continue;
    }
    if (Status status = check_counts(result.positions.size(), result.indices.size() / 3, options); !status) {
      return status.error();
    }
  }
  if (result.indices.empty()) {
    return make_error(
        ErrorCode::data_corrupt,
        fmt::format("found {} vertices and no face, expected an OBJ file", result.positions.size()), "path");
  }
  return result;
}

}  // namespace handloft::exchange::detail
