#include "client-hmd/hud/history_trail.h"

#include <algorithm>

namespace handloft::client {
namespace {

constexpr std::uint32_t deepest = 100'000;  ///< Of a history that is believed: names are kept by depth.

void set_top(std::vector<std::string>& names, std::uint32_t steps, const std::string& name) {
  names.resize(std::min(steps, deepest));
  if (!names.empty() && steps <= deepest) names.back() = name;
}

std::vector<std::string> from_top(const std::vector<std::string>& names) {
  const auto end =
      names.rbegin() + static_cast<std::ptrdiff_t>(std::min(names.size(), HistoryTrail::longest));
  return {names.rbegin(), std::find(names.rbegin(), end, std::string())};
}

}  // namespace

void HistoryTrail::follow(const Scene& scene) {
  const History& now = scene.history;
  if (scene.epoch != epoch_) {
    epoch_ = scene.epoch;
    undo_.clear();
    redo_.clear();
    last_ = {};
  }
  // A step that replaced the one before (undo and then something else) leaves the count: names above go.
  if (now.undo_steps > last_.undo_steps + 1)
    undo_.resize(std::min<std::size_t>(undo_.size(), last_.undo_steps));
  set_top(undo_, now.undo_steps, now.next_undo);
  set_top(redo_, now.redo_steps, now.next_redo);
  last_ = now;
}

HistoryRows HistoryTrail::rows() const {
  return {last_.undo_steps, last_.redo_steps, from_top(undo_), from_top(redo_)};
}

}  // namespace handloft::client
