#include "common/codec/vertex_residuals.h"

#include <zstd.h>
#include <algorithm>
#include <span>

#include <fmt/core.h>

namespace handloft::codec {
namespace {

constexpr std::size_t axes = 3;
constexpr std::size_t channels = axes + 2;  ///< Three of the position, two of the normal.
constexpr std::size_t bytes_a_vertex = 2 * channels;

/// Higher levels take thrice the time for 3 % fewer bytes of a dragged surface [bench_codec].
constexpr int level = 1;

/// One number of each vertex, 16 bits that wrap around.
using Channel = std::vector<std::uint16_t>;

/// Calls `each(i, prediction)` in the order of the vertices; the prediction for one asks only for those
/// before it.
template <typename Each>
void predict(const Channel& values, std::size_t row, const Each& each) {
  const std::size_t count = values.size();
  if (row == 0) row = std::max<std::size_t>(count, 1);
  const auto straight_on = [&](std::size_t i, std::size_t step) {
    if (i < step) return 0;
    return i < 2 * step ? int{values[i - step]} : 2 * values[i - step] - values[i - 2 * step];
  };
  for (std::size_t first = 0; first < count; first += row) {
    const std::size_t end = std::min(count, first + row);
    each(first, static_cast<std::uint16_t>(straight_on(first, row)));
    for (std::size_t i = first + 1; i < end; ++i) {
      const int prediction =
          first == 0 ? straight_on(i, 1) : values[i - 1] + values[i - row] - values[i - row - 1];
      each(i, static_cast<std::uint16_t>(prediction));
    }
  }
}

/// Small numbers of either sign as small numbers: 0, -1, 1, -2 as 0, 1, 2, 3.
std::uint16_t fold(std::uint16_t difference) {
  const bool negative = (difference & 0x8000U) != 0;
  return static_cast<std::uint16_t>((difference << 1U) ^ (negative ? 0xFFFFU : 0U));
}
std::uint16_t unfold(std::uint16_t folded) {
  return static_cast<std::uint16_t>((folded >> 1U) ^ ((folded & 1U) != 0 ? 0xFFFFU : 0U));
}

/// The low bytes of a channel's residuals, then the high ones: those are nearly all zero.
struct Planes {
  std::size_t low, high;
};
Planes planes_of(std::size_t channel, std::size_t count) {
  return {2 * channel * count, (2 * channel + 1) * count};
}

Error corrupt(std::string message) {
  return make_error(ErrorCode::data_corrupt, std::move(message), "residuals");
}

}  // namespace

std::string pack_residuals(const QuantisedVertices& vertices, std::uint32_t row) {
  const std::size_t count = vertices.positions.size();
  std::string planes(bytes_a_vertex * count, '\0');
  Channel values(count);
  for (std::size_t channel = 0; channel < channels; ++channel) {
    for (std::size_t i = 0; i < count; ++i) {
      values[i] = channel < axes ? vertices.positions[i][channel]
                                 : static_cast<std::uint16_t>(vertices.normals[i][channel - axes]);
    }
    const Planes at = planes_of(channel, count);
    predict(values, row, [&](std::size_t i, std::uint16_t prediction) {
      const std::uint16_t residual = fold(static_cast<std::uint16_t>(values[i] - prediction));
      planes[at.low + i] = static_cast<char>(residual & 0xFFU);
      planes[at.high + i] = static_cast<char>(residual >> 8U);
    });
  }
  std::string bytes(ZSTD_compressBound(planes.size()), '\0');
  // Cannot fail: there is room for what does not compress.
  bytes.resize(ZSTD_compress(bytes.data(), bytes.size(), planes.data(), planes.size(), level));
  return bytes;
}

Result<QuantisedVertices> unpack_residuals(std::string_view bytes, std::size_t count, std::uint32_t row) {
  if (row > count) {
    return make_error(ErrorCode::data_corrupt,
                      fmt::format("found {} vertices a row, expected at most all {}", row, count), "row");
  }
  const std::size_t wanted = bytes_a_vertex * count;
  // Before anything is allocated. One frame alone: what follows it would be left out silently.
  const unsigned long long told = ZSTD_getFrameContentSize(bytes.data(), bytes.size());
  if (told != wanted || ZSTD_findFrameCompressedSize(bytes.data(), bytes.size()) != bytes.size()) {
    return corrupt(
        fmt::format("{} bytes are not one frame of {} bytes for {} vertices", bytes.size(), wanted, count));
  }
  std::string planes(wanted, '\0');
  const std::size_t got = ZSTD_decompress(planes.data(), planes.size(), bytes.data(), bytes.size());
  if (ZSTD_isError(got) != 0U || got != wanted) {
    return corrupt(fmt::format("{} bytes do not give {} vertices: {}", bytes.size(), count,
                               ZSTD_isError(got) != 0U ? ZSTD_getErrorName(got) : "too few"));
  }
  QuantisedVertices vertices{std::vector<std::array<std::uint16_t, axes>>(count),
                             std::vector<std::array<std::int16_t, 2>>(count)};
  Channel values(count);
  for (std::size_t channel = 0; channel < channels; ++channel) {
    const Planes at = planes_of(channel, count);
    predict(values, row, [&](std::size_t i, std::uint16_t prediction) {
      const auto low = static_cast<std::uint8_t>(planes[at.low + i]);
      const auto high = static_cast<std::uint8_t>(planes[at.high + i]);
      const std::uint16_t residual = unfold(static_cast<std::uint16_t>(low | (high << 8U)));
      values[i] = static_cast<std::uint16_t>(prediction + residual);
    });
    for (std::size_t i = 0; i < count; ++i) {
      if (channel < axes) {
        vertices.positions[i][channel] = values[i];
      } else {
        vertices.normals[i][channel - axes] = static_cast<std::int16_t>(values[i]);
      }
    }
  }
  return vertices;
}

}  // namespace handloft::codec
