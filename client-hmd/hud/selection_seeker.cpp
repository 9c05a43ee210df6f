#include "client-hmd/hud/selection_seeker.h"

#include <utility>

namespace handloft::client {

void SelectionSeeker::seek(std::string id) {
  wanted_ = std::move(id);
  steps_ = 0;
  waiting_ = false;
}

bool SelectionSeeker::step(const Scene& scene, TimePoint now) {
  if (wanted_.empty()) return false;
  std::string selected;
  for (const auto& [id, entity] : scene.entities) {
    if (entity->selected) selected = id;
  }
  const bool gone = scene.entities.find(wanted_) == scene.entities.end();
  if (gone || selected == wanted_ || steps_ > scene.entities.size()) {
    wanted_.clear();
    return false;
  }
  if (waiting_) {
    const bool seen = selected != last_selected_;
    if (!seen && now - asked_at_ < patience) return false;
    if (!seen) {
      wanted_.clear();
      return false;
    }
  }
  waiting_ = true;
  asked_at_ = now;
  last_selected_ = selected;
  ++steps_;
  return true;
}

}  // namespace handloft::client
