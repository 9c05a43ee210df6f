#include "common/codec/point_codec.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <string>
#include <string_view>

#include <fmt/core.h>

namespace handloft::codec {
namespace {

static_assert(std::endian::native == std::endian::little,
              "the wire is little-endian, and so is the copy of it");

constexpr std::size_t position_bytes = 3 * sizeof(std::int32_t);
constexpr std::size_t style_bytes = sizeof(std::uint16_t);
constexpr int shells = 5;

Error wrong(ErrorCode code, std::string field, std::string message) {
  return make_error(code, std::move(message), std::move(field));
}

Error too_many(std::string_view field, std::size_t found, std::size_t limit) {
  return wrong(ErrorCode::resource_exhausted, std::string(field),
               fmt::format("found {}, expected at most {}", found, limit));
}

bool is_coordinate(double value, const PointLimits& limits) {
  return std::isfinite(value) && std::abs(value) <= limits.max_coordinate_m;
}

/// Names the first field of a style that a renderer could not use; empty when all is well.
std::string_view broken_field(const FuzzyStyle& style) {
  const auto in = [](float value, float high) {
    return std::isfinite(value) && value >= 0.0F && value <= high;
  };
  constexpr float max_radius_m = 1.0F;  // a fuzzy point as large as the table
  if (!(style.pressure >= 0.0 && style.pressure <= 1.0)) return "pressure";
  if (!in(style.radius_m, max_radius_m)) return "radius_m";
  for (std::size_t k = 0; k < shells; ++k) {
    if (!in(style.shell_radius_m[k], max_radius_m)) return "shell_radius_m";
    if (!in(style.shell_alpha[k], 1.0F)) return "shell_alpha";
  }
  return {};
}

Status check_tail(const PointTail& tail, ErrorCode bad, const PointLimits& limits) {
  if (tail.total > limits.max_points) return too_many("total", tail.total, limits.max_points);
  if (tail.palette.size() > limits.max_styles)
    return too_many("palette", tail.palette.size(), limits.max_styles);
  if (tail.first > tail.total || tail.positions.size() != std::size_t{tail.total} - tail.first) {
    return wrong(
        bad, "total",
        fmt::format("found {} with {} points from {}", tail.total, tail.positions.size(), tail.first));
  }
  if (tail.styles.size() != tail.positions.size()) {
    return wrong(bad, "styles",
                 fmt::format("found {}, expected one for each of {} points", tail.styles.size(),
                             tail.positions.size()));
  }
  for (std::size_t i = 0; i < tail.palette.size(); ++i) {
    if (const std::string_view field = broken_field(tail.palette[i]); !field.empty()) {
      return wrong(bad, fmt::format("palette[{}].{}", i, field), "out of range or not a number");
    }
  }
  for (std::size_t i = 0; i < tail.positions.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!is_coordinate(tail.positions[i][axis], limits)) {
        return wrong(bad, fmt::format("positions[{}][{}]", i, axis),
                     fmt::format("found {}, expected a number within {} m", tail.positions[i][axis],
                                 limits.max_coordinate_m));
      }
    }
    if (tail.styles[i] >= tail.palette.size()) {
      return wrong(
          bad, fmt::format("styles[{}]", i),
          fmt::format("found {}, expected less than {} in the palette", tail.styles[i], tail.palette.size()));
    }
  }
  return {};
}

}  // namespace

Result<v1::PointCloud> encode_points(const PointTail& tail, const PointCodecOptions& options,
                                     const PointLimits& limits) {
  constexpr ErrorCode bad = ErrorCode::invalid_argument;
  if (!(std::isfinite(options.step_m) && options.step_m > 0.0)) {
    return wrong(bad, "step_m", fmt::format("found {}, expected a positive number", options.step_m));
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!is_coordinate(options.origin_m[axis], limits))
      return wrong(bad, "origin", "not a number, or too far away");
  }
  if (const Status checked = check_tail(tail, bad, limits); !checked) return checked.error();

  v1::PointCloud message;
  message.set_total(tail.total);
  message.set_first(tail.first);
  message.mutable_origin()->set_x(options.origin_m[0]);
  message.mutable_origin()->set_y(options.origin_m[1]);
  message.mutable_origin()->set_z(options.origin_m[2]);
  message.set_step_m(options.step_m);
  std::string positions(tail.positions.size() * position_bytes, '\0');
  for (std::size_t i = 0; i < tail.positions.size(); ++i) {
    std::array<std::int32_t, 3> quantised{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double q = std::round((tail.positions[i][axis] - options.origin_m[axis]) / options.step_m);
      if (!(std::abs(q) <= static_cast<double>(std::numeric_limits<std::int32_t>::max()))) {
        return wrong(bad, fmt::format("positions[{}][{}]", i, axis),
                     fmt::format("{} is out of reach of 32 bits in steps of {} m", tail.positions[i][axis],
                                 options.step_m));
      }
      quantised[axis] = static_cast<std::int32_t>(q);
    }
    std::memcpy(positions.data() + i * position_bytes, quantised.data(), position_bytes);
  }
  message.set_positions(std::move(positions));
  std::string styles(tail.styles.size() * style_bytes, '\0');
  if (!styles.empty()) std::memcpy(styles.data(), tail.styles.data(), styles.size());
  message.set_styles(std::move(styles));
  for (const FuzzyStyle& style : tail.palette) {
    v1::FuzzyStyle& to = *message.add_palette();
    to.set_pressure(style.pressure);
    to.set_radius_m(style.radius_m);
    for (const float radius : style.shell_radius_m) to.add_shell_radius_m(radius);
    for (const float alpha : style.shell_alpha) to.add_shell_alpha(alpha);
  }
  return message;
}

Result<PointTail> decode_points(const v1::PointCloud& message, const PointLimits& limits) {
  constexpr ErrorCode bad = ErrorCode::data_corrupt;
  if (message.total() > limits.max_points) return too_many("total", message.total(), limits.max_points);
  if (message.first() > message.total()) {
    return wrong(bad, "first",
                 fmt::format("found {}, expected at most the total of {}", message.first(), message.total()));
  }
  const std::size_t count = std::size_t{message.total()} - message.first();
  if (message.positions().size() != count * position_bytes) {
    return wrong(bad, "positions",
                 fmt::format("found {} bytes, expected {} for {} points", message.positions().size(),
                             count * position_bytes, count));
  }
  if (message.styles().size() != count * style_bytes) {
    return wrong(bad, "styles",
                 fmt::format("found {} bytes, expected {} for {} points", message.styles().size(),
                             count * style_bytes, count));
  }
  const auto palette_size = static_cast<std::size_t>(message.palette_size());
  if (palette_size > limits.max_styles) return too_many("palette", palette_size, limits.max_styles);
  if (!(std::isfinite(message.step_m()) && message.step_m() > 0.0) && count > 0) {
    return wrong(bad, "step_m", fmt::format("found {}, expected a positive number", message.step_m()));
  }
  PointTail tail;
  tail.total = message.total();
  tail.first = message.first();
  tail.palette.reserve(palette_size);
  for (int i = 0; i < message.palette_size(); ++i) {
    const v1::FuzzyStyle& from = message.palette(i);
    if (from.shell_radius_m_size() != shells || from.shell_alpha_size() != shells) {
      return wrong(bad, fmt::format("palette[{}]", i),
                   fmt::format("found {} radii and {} alphas, expected {} of each",
                               from.shell_radius_m_size(), from.shell_alpha_size(), shells));
    }
    FuzzyStyle style{from.pressure(), from.radius_m(), {}, {}};
    std::copy(from.shell_radius_m().begin(), from.shell_radius_m().end(), style.shell_radius_m.begin());
    std::copy(from.shell_alpha().begin(), from.shell_alpha().end(), style.shell_alpha.begin());
    tail.palette.push_back(style);
  }
  const std::array<double, 3> origin{message.origin().x(), message.origin().y(), message.origin().z()};
  tail.positions.resize(count);
  tail.styles.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    std::array<std::int32_t, 3> quantised{};
    std::memcpy(quantised.data(), message.positions().data() + i * position_bytes, position_bytes);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      tail.positions[i][axis] = origin[axis] + message.step_m() * quantised[axis];
    }
  }
  if (count > 0) std::memcpy(tail.styles.data(), message.styles().data(), count * style_bytes);
  if (const Status checked = check_tail(tail, bad, limits); !checked) return checked.error();
  return tail;
}

Status merge_points(PointTail& held, const PointTail& tail, const PointLimits& limits) {
  constexpr ErrorCode bad = ErrorCode::data_corrupt;
  if (held.first != 0)
    return wrong(ErrorCode::invalid_argument, "held.first", fmt::format("found {}, expected 0", held.first));
  if (const Status checked = check_tail(tail, bad, limits); !checked) return checked;
  if (tail.first > held.total) {
    return wrong(bad, "first",
                 fmt::format("found {}, expected at most the {} points held", tail.first, held.total));
  }
  if (tail.first == 0) {
    held = tail;
    return {};
  }
  std::map<double, std::uint16_t> known;  // by pressure: a style is a function of it
  for (std::size_t i = 0; i < held.palette.size(); ++i) {
    known.emplace(held.palette[i].pressure, static_cast<std::uint16_t>(i));
  }
  std::vector<FuzzyStyle> palette = held.palette;
  std::vector<std::uint16_t> renamed(tail.palette.size());
  for (std::size_t i = 0; i < tail.palette.size(); ++i) {
    const auto [at, inserted] =
        known.emplace(tail.palette[i].pressure, static_cast<std::uint16_t>(palette.size()));
    if (inserted) palette.push_back(tail.palette[i]);
    renamed[i] = at->second;
  }
  if (palette.size() > limits.max_styles) return too_many("palette", palette.size(), limits.max_styles);
  held.palette = std::move(palette);
  held.total = tail.total;
  held.positions.resize(tail.first);
  held.styles.resize(tail.first);
  held.positions.insert(held.positions.end(), tail.positions.begin(), tail.positions.end());
  for (const std::uint16_t style : tail.styles) held.styles.push_back(renamed[style]);
  return {};
}

}  // namespace handloft::codec
