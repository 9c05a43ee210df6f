#pragma once
// Clouds of fuzzy points on the wire (A1 to A3): 32-bit positions in steps of a micrometre and a 16-bit index
// into the message's own palette of styles. Points arrive in order and are only ever appended while a stroke
// grows, so that a message may carry just the tail; a message with `first` = 0 replaces the whole cloud.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/base/result.h"
#include "proto/scene.pb.h"

namespace handloft::codec {

/// What a point of one certainty looks like: five nested spheres, outer to inner (A3).
struct FuzzyStyle {
  double pressure = 0.0;  ///< rho, 0..1
  float radius_m = 0.0F;
  std::array<float, 5> shell_radius_m{};
  std::array<float, 5> shell_alpha{};  ///< to be composited 'over', outermost first
  bool operator==(const FuzzyStyle&) const = default;
};

/// Points [first, total) of a cloud. `styles` is as long as `positions` and indexes `palette`.
struct PointTail {
  std::uint32_t total = 0;
  std::uint32_t first = 0;
  std::vector<std::array<double, 3>> positions;  ///< world, metres
  std::vector<std::uint16_t> styles;
  std::vector<FuzzyStyle> palette;
};

struct PointLimits {
  std::size_t max_points = std::size_t{1}
                           << 22;  ///< 100 MiB decoded; ten hours of strokes at 100 points a second
  std::size_t max_styles = 4096;   ///< the glove knows 1024 levels of pressure
  double max_coordinate_m = 1e4;   ///< nothing on a table is 10 km away
};

struct PointCodecOptions {
  double step_m = 1e-6;                     ///< a hundredth of the trackers' noise
  std::array<double, 3> origin_m{0, 0, 0};  ///< int32 reaches 2 km around it
};

/// The tail, quantised: positions come back within half a step. Errors: invalid_argument naming the field for
/// NaN, unequal lengths, total != first + points, a style beyond the palette, a position out of reach;
/// resource_exhausted over a limit.
Result<v1::PointCloud> encode_points(const PointTail& tail, const PointCodecOptions& options = {},
                                     const PointLimits& limits = {});

/// The tail of a message that may come from anybody. Errors: data_corrupt or resource_exhausted, naming the
/// field.
Result<PointTail> decode_points(const v1::PointCloud& message, const PointLimits& limits = {});

/// Appends `tail` to the cloud `held` (held.first = 0): points before tail.first stay, those behind are
/// replaced, palettes are united. Errors: data_corrupt when tail.first lies beyond what is held (a lost
/// message); `held` is then as it was.
Status merge_points(PointTail& held, const PointTail& tail, const PointLimits& limits = {});

}  // namespace handloft::codec
