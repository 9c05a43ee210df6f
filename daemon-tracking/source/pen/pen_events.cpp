#include "daemon-tracking/source/pen/pen_events.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace handloft::tracking {
namespace {

constexpr std::uint8_t facts_version = 1;
constexpr std::size_t axis_size = 1 + 3 * 4;
constexpr std::size_t axis_count = 5;
constexpr std::array<const char*, axis_count> axis_names{"x", "y", "pressure", "tilt_x", "tilt_y"};

template <typename T>
void put(std::vector<std::uint8_t>& to, T value) {
  const auto bits = static_cast<std::uint64_t>(value);
  for (std::size_t i = 0; i < sizeof(T); ++i) to.push_back(static_cast<std::uint8_t>(bits >> (8 * i)));
}

template <typename T>
T get(std::span<const std::uint8_t> from, std::size_t at) {
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i) bits |= std::uint64_t{from[at + i]} << (8 * i);
  return static_cast<T>(bits);
}

}  // namespace

std::vector<std::uint8_t> encode_pen_facts(const PenFacts& facts) {
  std::vector<std::uint8_t> out{facts_version};
  for (const PenAxis* axis : {&facts.x, &facts.y, &facts.pressure, &facts.tilt_x, &facts.tilt_y}) {
    put(out, static_cast<std::uint8_t>(axis->present ? 1 : 0));
    put(out, axis->minimum);
    put(out, axis->maximum);
    put(out, axis->resolution);
  }
  return out;
}

Result<PenFacts> parse_pen_facts(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t size = 1 + axis_count * axis_size;
  if (bytes.size() != size) {
    return make_error(ErrorCode::data_corrupt, fmt::format("found {} bytes, expected {}", bytes.size(), size),
                      "length");
  }
  if (bytes[0] != facts_version) {
    return make_error(ErrorCode::unsupported, fmt::format("found {}, expected {}", bytes[0], facts_version),
                      "version");
  }
  PenFacts out;
  const std::array<PenAxis*, axis_count> axes{&out.x, &out.y, &out.pressure, &out.tilt_x, &out.tilt_y};
  for (std::size_t i = 0; i < axis_count; ++i) {
    const std::size_t at = 1 + i * axis_size;
    PenAxis& axis = *axes[i];
    if (bytes[at] > 1) {
      return make_error(ErrorCode::invalid_argument, fmt::format("found {}, expected 0 or 1", bytes[at]),
                        axis_names[i]);
    }
    axis = {bytes[at] == 1, get<std::int32_t>(bytes, at + 1), get<std::int32_t>(bytes, at + 5),
            get<std::int32_t>(bytes, at + 9)};
    if (axis.present && (axis.minimum >= axis.maximum || axis.resolution < 0)) {
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found {}..{} at {} a unit, expected a rising range", axis.minimum,
                                    axis.maximum, axis.resolution),
                        axis_names[i]);
    }
  }
  if (!out.x.present || !out.y.present)
    return make_error(ErrorCode::invalid_argument, "a tablet has both axes", out.x.present ? "y" : "x");
  return out;
}

std::vector<std::uint8_t> encode_pen_events(std::span<const PenEvent> events) {
  std::vector<std::uint8_t> out;
  events = events.first(std::min(events.size(), max_pen_events));
  out.reserve(events.size() * pen_event_size);
  for (const PenEvent& event : events) {
    put(out, to_ns(event.time));
    put(out, event.type);
    put(out, event.code);
    put(out, event.value);
  }
  return out;
}

Result<std::vector<PenEvent>> parse_pen_events(std::span<const std::uint8_t> bytes) {
  const std::size_t count = bytes.size() / pen_event_size;
  if (bytes.size() % pen_event_size != 0 || count == 0 || count > max_pen_events) {
    return make_error(ErrorCode::data_corrupt,
                      fmt::format("found {} bytes, expected 1 to {} events of {}", bytes.size(),
                                  max_pen_events, pen_event_size),
                      "length");
  }
  std::vector<PenEvent> out(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = i * pen_event_size;
    out[i] = {from_ns(get<std::int64_t>(bytes, at)), get<std::uint16_t>(bytes, at + 8),
              get<std::uint16_t>(bytes, at + 10), get<std::int32_t>(bytes, at + 12)};
  }
  return out;
}

}  // namespace handloft::tracking
