#include "server-model/stream/curves.h"

#include <array>
#include <bit>
#include <cstdint>
#include <string>

namespace handloft::stream {
namespace {

constexpr std::size_t max_places = 2000;  ///< 24 KB; on the screen more are no finer.

void append(float value, std::string& bytes) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  for (unsigned shift = 0; shift < 32; shift += 8)
    bytes.push_back(static_cast<char>((bits >> shift) & 0xffU));
}

}  // namespace

bool curves_differ(const model::DualShape* before, const model::DualShape& after) {
  if (before == nullptr) return after.boundary != nullptr;
  return before->boundary != after.boundary || (after.boundary && before->fit != after.fit);
}

void write_curves(const model::DualShape& shape, v1::EntityState& state) {
  state.set_curves_shown(true);
  if (!shape.fit || !shape.boundary) return;
  const auto trim = shape.trim();
  if (!trim || trim->boundary() == nullptr) return;
  const auto& polygon = trim->boundary()->polygon();
  v1::Polyline& line = *state.add_curves();
  line.set_closed(true);
  line.set_kind(v1::Polyline::BOUNDARY);
  const std::size_t step = (polygon.size() + max_places - 1) / max_places;
  std::string bytes;
  for (std::size_t i = 0; i < polygon.size(); i += step) {
    const geometry::Vec3 place =
        shape.fit->surface.world_point(shape.fit->frame, polygon[i].x(), polygon[i].y());
    for (const double coordinate : place) append(static_cast<float>(coordinate), bytes);
  }
  line.set_points(std::move(bytes));
}

}  // namespace handloft::stream
