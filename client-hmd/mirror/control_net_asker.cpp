#include "client-hmd/mirror/control_net_asker.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstring>

namespace handloft::client {
namespace {

constexpr std::size_t bytes_per_point = 12;
constexpr std::uint32_t fewest_a_side = 2;

float little_endian_float(const char* bytes) {
  std::uint32_t word = 0;
  for (unsigned i = 0; i < 4; ++i) word |= std::uint32_t{static_cast<unsigned char>(bytes[i])} << (8 * i);
  return std::bit_cast<float>(word);
}

bool has_net(const Entity& entity) {
  return entity.shows_surface() &&
         (entity.kind == EntityKind::dual_shape || entity.kind == EntityKind::sculpt_surface);
}

}  // namespace

Result<ControlNet> read_control_net(const v1::ControlNetResult& message, const ControlNetLimits& limits) {
  const std::uint64_t count = std::uint64_t{message.rows()} * message.columns();
  if (message.rows() < fewest_a_side || message.columns() < fewest_a_side) {
    return make_error(ErrorCode::data_corrupt,
                      fmt::format("found {} x {}, expected at least {} x {}", message.rows(),
                                  message.columns(), fewest_a_side, fewest_a_side),
                      "rows");
  }
  if (count > limits.max_points) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found {} points, expected at most {}", count, limits.max_points),
                      "points");
  }
  if (message.points().size() != count * bytes_per_point) {
    return make_error(ErrorCode::data_corrupt,
                      fmt::format("found {} bytes, expected {} for {} x {} points", message.points().size(),
                                  count * bytes_per_point, message.rows(), message.columns()),
                      "points");
  }
  ControlNet net{message.rows(), message.columns(), {}};
  net.points.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const char* at = message.points().data() + i * bytes_per_point;
    const Vec3f p{little_endian_float(at), little_endian_float(at + 4), little_endian_float(at + 8)};
    for (const float c : {p.x, p.y, p.z}) {
      if (!(std::abs(c) <= limits.max_coordinate_m)) {
        return make_error(
            ErrorCode::data_corrupt,
            fmt::format("point {}: found {}, expected at most {} m", i, c, limits.max_coordinate_m),
            "points");
      }
    }
    net.points.push_back(p);
  }
  return net;
}

std::vector<v1::Envelope> ControlNetAsker::questions(const Scene& scene) {
  const auto is_gone = [&scene](const auto& item) {
    const auto found = scene.entities.find(item.first);
    return found == scene.entities.end() || !has_net(*found->second);
  };
  std::erase_if(nets_, is_gone);
  // What is under way for an entity that is gone is forgotten: its answer is then to no question of ours.
  std::erase_if(asked_, is_gone);
  std::vector<v1::Envelope> out;
  for (const auto& [id, entity] : scene.entities) {
    if (!has_net(*entity)) continue;
    Asked& asked = asked_[id];
    if (asked.request != 0 || (asked.ever && asked.revision == entity->revision)) continue;
    asked = {next_request_++, entity->revision, true};
    v1::Envelope envelope;
    v1::Ask& ask = *envelope.mutable_ask();
    ask.set_request(asked.request);
    ask.mutable_query()->mutable_control_net()->set_entity(id);
    out.push_back(std::move(envelope));
  }
  return out;
}

bool ControlNetAsker::take(const v1::Answer& answer) {
  for (auto& [id, asked] : asked_) {
    if (asked.request == 0 || asked.request != answer.request()) continue;
    asked.request = 0;
    nets_.erase(id);
    if (!answer.has_result() || !answer.result().has_control_net()) return true;
    Result<ControlNet> net = read_control_net(answer.result().control_net());
    if (net) nets_[id] = std::make_shared<const ControlNet>(std::move(*net));
    return true;
  }
  return false;
}

void ControlNetAsker::forget() {
  asked_.clear();
}

}  // namespace handloft::client
