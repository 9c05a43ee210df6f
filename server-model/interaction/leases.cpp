#include "server-model/interaction/leases.h"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <utility>

namespace handloft::interaction {

std::vector<std::string> deformed_entities(const v1::Operation& operation) {
  std::vector<std::string> ids;
  switch (operation.body_case()) {
    case v1::Operation::kPushPoints:
      ids.assign(operation.push_points().entities().begin(), operation.push_points().entities().end());
      break;
    case v1::Operation::kModifyProfile: {
      const v1::ModifyProfile& profile = operation.modify_profile();
      ids.assign(profile.entities().begin(), profile.entities().end());
      for (const v1::ProfileCurve& curve : profile.curves()) {
        ids.push_back(curve.entity());
        ids.insert(ids.end(), curve.split_entities().begin(), curve.split_entities().end());
      }
      break;
    }
    case v1::Operation::kMovePoints:
      ids.push_back(operation.move_points().entity());
      break;
    case v1::Operation::kTransform:
      ids.assign(operation.transform().entities().begin(), operation.transform().entities().end());
      break;
    case v1::Operation::kDragIcon:
      ids.push_back(operation.drag_icon().entity());
      break;
    default:
      break;
  }
  std::erase(ids, std::string());
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  return ids;
}

Leases::Leases(std::function<TimePoint()> now, LeaseOptions options)
    : now_(now ? std::move(now) : [] { return TimePoint{}; }), options_(options) {}

void Leases::introduce(std::uint64_t client_id, std::string name) {
  names_[client_id] = std::move(name);
}

std::string Leases::name_of(std::uint64_t client_id) const {
  const auto found = names_.find(client_id);
  if (found != names_.end()) return found->second;
  return client_id == 0 ? "hand" : fmt::format("client {}", client_id);
}

Status Leases::check(const std::string& entity, std::uint64_t client_id) const {
  const auto found = held_.find(entity);
  if (found == held_.end() || found->second.client_id == client_id) return {};
  const Duration left = found->second.until() - now_();
  if (left <= Duration::zero()) return {};
  const auto seconds = std::chrono::ceil<std::chrono::seconds>(left).count();
  return make_error(ErrorCode::failed_precondition,
                    fmt::format("{} shapes \"{}\" at present, for another {} s at least",
                                name_of(found->second.client_id), entity, seconds),
                    "entity");
}

Status Leases::check(const v1::Operation& operation) const {
  if (held_.empty()) return {};
  for (const std::string& id : deformed_entities(operation)) {
    if (Status free = check(id, operation.client_id()); !free) return free;
  }
  return {};
}

Status Leases::take(const std::string& entity, std::uint64_t client_id, Kind kind) {
  if (Status free = check(entity, client_id); !free) return free;
  const TimePoint now = now_();
  auto found = held_.find(entity);
  if (kind == Kind::asked &&
      (found == held_.end() || found->second.client_id != client_id || found->second.asked_until <= now)) {
    const auto asked = std::count_if(held_.begin(), held_.end(), [&](const auto& item) {
      return item.second.client_id == client_id && item.second.asked_until > now;
    });
    if (static_cast<std::size_t>(asked) >= options_.max_asked) {
      return make_error(
          ErrorCode::resource_exhausted,
          fmt::format("found leases on {} entities already, expected at most {}", asked, options_.max_asked),
          "lease.entity");
    }
  }
  if (found == held_.end()) found = held_.emplace(entity, Held{client_id}).first;
  Held& held = found->second;
  if (held.client_id != client_id) held = Held{client_id};
  (kind == Kind::gesture ? held.gesture_until : held.asked_until) = now + options_.lasts;
  return {};
}

void Leases::release(const std::string& entity, std::uint64_t client_id, Kind kind) {
  const auto found = held_.find(entity);
  if (found == held_.end() || found->second.client_id != client_id) return;
  (kind == Kind::gesture ? found->second.gesture_until : found->second.asked_until) = TimePoint::min();
  if (found->second.until() <= now_()) held_.erase(found);
}

void Leases::release_all(std::uint64_t client_id) {
  std::erase_if(held_, [&](const auto& item) { return item.second.client_id == client_id; });
}

void Leases::forget(std::uint64_t client_id) {
  release_all(client_id);
  names_.erase(client_id);
}

std::map<std::string, Lease> Leases::current() const {
  std::map<std::string, Lease> result;
  const TimePoint now = now_();
  for (const auto& [entity, held] : held_) {
    if (held.until() > now) result.emplace(entity, Lease{held.client_id, name_of(held.client_id)});
  }
  return result;
}

bool Leases::sweep() {
  return std::erase_if(held_, [now = now_()](const auto& item) { return item.second.until() <= now; }) > 0;
}

}  // namespace handloft::interaction
