#include "client-hmd/mirror/resume.h"

#include <algorithm>

namespace handloft::client {

bool covers(const Scene& former, const Scene& next) {
  const auto points_of = [](const Entity& entity) {
    return entity.points == nullptr ? 0 : entity.points->points.size();
  };
  return std::all_of(former.entities.begin(), former.entities.end(), [&](const auto& item) {
    const auto found = next.entities.find(item.first);
    if (found == next.entities.end()) return false;
    const Entity& before = *item.second;
    const Entity& after = *found->second;
    return points_of(after) >= points_of(before) && (before.surface == nullptr || after.surface != nullptr);
  });
}

v1::Join join_with(const Scene& held) {
  v1::Join join;
  join.set_epoch(held.epoch);
  for (const auto& [id, entity] : held.entities) {
    v1::HeldEntity& have = *join.add_have();
    have.set_id(id);
    have.set_revision(entity->revision);
    if (entity->points) have.set_points(static_cast<std::uint32_t>(entity->points->points.size()));
    if (entity->surface) have.set_surface_id(entity->surface_id);
  }
  return join;
}

std::shared_ptr<const Scene> Resumption::choose(const std::shared_ptr<const Scene>& former,
                                                const std::shared_ptr<const Scene>& newest, TimePoint now) {
  if (now < until_ && !covers(*former, *newest)) return former;
  until_ = TimePoint::min();  // What is removed later is removed at once.
  return newest;
}

}  // namespace handloft::client
