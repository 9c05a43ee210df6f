#include "client-hmd/main/ghost_tracker.h"

#include <algorithm>

namespace handloft::client {
namespace {

/// A told speed beyond what hands and heads do would throw a ghost across the room.
constexpr double fastest_m_s = 5.0, fastest_rad_s = 10.0;
constexpr float predicted_certainty = 0.5F;

glm::dvec3 vector_of(const Vec3f& v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}

glm::dvec3 at_most(const glm::dvec3& v, double length) {
  const double found = glm::length(v);
  return found > length ? length / found * v : v;
}

/// Where it is at `time`; what is not told any more stays where it was last.
std::optional<RigidPose> place_at(const PoseHistory& history, TimePoint time) {
  const std::optional<PoseAnswer> answer = history.at(time);
  return answer ? std::optional(answer->pose) : std::nullopt;
}

}  // namespace

bool is_ours(const ActivityKey& key, std::uint64_t own_client_id, TrackedHand tracked) {
  if (key.client_id == 0) return tracked == TrackedHand::ours;
  return key.client_id == own_client_id;
}

PoseHistory GhostTracker::history() const {
  PoseHistoryOptions options;
  constexpr std::size_t enough_for_the_delay = 32;
  options.capacity = enough_for_the_delay;
  options.largest_gap = options_.largest_gap;
  // The motion eases to a halt by itself; then the ghost waits to fade.
  options.longest_prediction = options_.stale + options_.fade + options_.delay;
  return PoseHistory(options);
}

GhostTracker::Ghost GhostTracker::begin() const {
  Ghost ghost;
  ghost.tips.fill(history());
  ghost.head = history();
  return ghost;
}

void GhostTracker::push(Ghost& ghost, const Activity& activity) {
  ghost.activity = activity;
  for (std::size_t i = 0; i < tips_of_a_hand; ++i) {
    const TipMark tip = activity.hand ? activity.hand->tips[i] : TipMark{};
    if (tip.state == TipState::lost) {
      ghost.tips[i].clear();
      continue;
    }
    MeasuredPose sample;
    sample.time = activity.received_at;
    sample.pose.position = vector_of(tip.place);
    sample.linear_velocity = at_most(vector_of(tip.velocity), fastest_m_s);
    (void)ghost.tips[i].push(sample);
  }
  if (!activity.head) {
    ghost.head.clear();
    return;
  }
  MeasuredPose sample;
  sample.time = activity.received_at;
  sample.pose.position = vector_of(activity.head->place);
  const auto& q = activity.head->orientation;
  sample.pose.orientation = {static_cast<double>(q[0]), static_cast<double>(q[1]), static_cast<double>(q[2]),
                             static_cast<double>(q[3])};
  sample.linear_velocity = at_most(vector_of(activity.head->velocity), fastest_m_s);
  sample.angular_velocity = at_most(vector_of(activity.head->angular_velocity), fastest_rad_s);
  (void)ghost.head.push(sample);
}

void GhostTracker::take(const ModelState& model, TrackedHand tracked) {
  std::erase_if(ghosts_, [&](const auto& item) {
    return model.activities.count(item.first) == 0 || is_ours(item.first, model.own_client_id, tracked);
  });
  for (const auto& [key, activity] : model.activities) {
    if (is_ours(key, model.own_client_id, tracked)) continue;
    const auto [found, is_new] = ghosts_.try_emplace(key);
    if (is_new) found->second = begin();
    if (is_new || activity.received_at > found->second.activity.received_at) push(found->second, activity);
  }
}

std::vector<GhostHint> GhostTracker::at(TimePoint now,
                                        const std::function<glm::vec3(std::uint64_t)>& colour) const {
  std::vector<GhostHint> hints;
  for (const auto& [key, ghost] : ghosts_) {
    const Duration silent = now - ghost.activity.received_at;
    if (silent > options_.stale + options_.fade) continue;
    GhostHint hint;
    hint.client_id = key.client_id;
    hint.name = ghost.activity.name;
    hint.doing = ghost.activity.tool;
    hint.entity = ghost.activity.entity;
    hint.colour = colour(key.client_id);
    if (silent > options_.stale) {
      hint.opacity =
          1.0F - static_cast<float>(to_seconds(silent - options_.stale) / to_seconds(options_.fade));
    }
    const TimePoint shown = now - options_.delay;
    if (ghost.activity.hand) {
      hint.posture = ghost.activity.hand->posture;
      for (std::size_t i = 0; i < tips_of_a_hand; ++i) {
        const std::optional<RigidPose> tip = place_at(ghost.tips[i], shown);
        if (!tip) continue;
        const bool seen = ghost.activity.hand->tips[i].state == TipState::seen;
        hint.tips[i] = HandTip{glm::vec3(tip->position), seen ? 1.0F : predicted_certainty};
      }
    }
    hint.head = place_at(ghost.head, shown);
    if (ghost.activity.disk) {
      const DiskMark& disk = *ghost.activity.disk;
      hint.disk = DiskHint{glm::vec3(vector_of(disk.centre)), glm::vec3(vector_of(disk.normal)),
                           disk.radius_m, ghost.activity.range, std::nullopt};
    }
    hint.curve = ghost.activity.curve;
    hints.push_back(std::move(hint));
  }
  return hints;
}

}  // namespace handloft::client
