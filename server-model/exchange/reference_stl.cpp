// STL, binary and text. A binary file is known by its length, since its first bytes may say "solid" too.

#include <fmt/format.h>

#include <bit>
#include <cstdint>

#include "server-model/exchange/raw_triangles.h"
#include "server-model/exchange/reference_text.h"

namespace handloft::exchange::detail {
namespace {

constexpr std::size_t header_bytes = 84;
constexpr std::size_t triangle_bytes = 50;
constexpr std::size_t normal_bytes = 12;

std::uint32_t read_u32(std::span<const std::byte> content, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t k = 0; k < 4; ++k) value |= std::to_integer<std::uint32_t>(content[at + k]) << (8U * k);
  return value;
}

RawTriangles read_binary(std::span<const std::byte> content, std::uint32_t triangles) {
  RawTriangles result;
  result.positions.reserve(std::size_t{3} * triangles);
  for (std::size_t t = 0; t < triangles; ++t) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      geometry::Vec3 p;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::size_t at = header_bytes + triangle_bytes * t + normal_bytes + 12 * corner + 4 * axis;
        p[static_cast<int>(axis)] = static_cast<double>(std::bit_cast<float>(read_u32(content, at)));
      }
      result.indices.push_back(static_cast<std::uint32_t>(result.positions.size()));
      result.positions.push_back(p);
    }
  }
  return result;
}

Result<RawTriangles> read_text(std::string_view text, const ReferenceOptions& options) {
  RawTriangles result;
  const auto corrupt = [&](std::string_view what) {
    return make_error(ErrorCode::data_corrupt,
                      fmt::format("after {} vertices: {}", result.positions.size(), what), "path");
  };
  for (std::string_view word = take_word(text); !word.empty(); word = take_word(text)) {
    if (word == "vertex") {
      geometry::Vec3 p;
      for (int axis = 0; axis < 3; ++axis) {
        const auto value = to_number<double>(take_word(text));
        if (!value) return corrupt("found a vertex that is not three numbers");
        p[axis] = *value;
      }
      result.indices.push_back(static_cast<std::uint32_t>(result.positions.size()));
      result.positions.push_back(p);
    } else if (word == "endloop" && result.positions.size() % 3 != 0) {
      return corrupt("found a facet that has not three vertices");
    }
    if (Status status = check_counts(result.positions.size(), result.indices.size() / 3, options); !status) {
      return status.error();
    }
  }
  if (result.positions.empty() || result.positions.size() % 3 != 0)
    return corrupt("the file ends, expected facets");
  return result;
}

}  // namespace

Result<RawTriangles> read_stl(std::span<const std::byte> content, const ReferenceOptions& options) {
  if (content.size() >= header_bytes) {
    const std::uint32_t triangles = read_u32(content, header_bytes - 4);
    if (content.size() == header_bytes + triangle_bytes * std::size_t{triangles}) {
      if (Status status = check_counts(0, triangles, options); !status) return status.error();
      return read_binary(content, triangles);
    }
  }
  std::string_view text = as_text(content);
  std::string_view begin = text;
  if (take_word(begin) != "solid") {
    return make_error(
        ErrorCode::data_corrupt,
        "found neither \"solid\" nor a length that fits the number of triangles, expected an STL file",
        "path");
  }
  take_line(text);  // The name may be any words.
  return read_text(text, options);
}

}  // namespace handloft::exchange::detail
