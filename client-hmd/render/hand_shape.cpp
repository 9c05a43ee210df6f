#include "client-hmd/render/hand_shape.h"

#include <algorithm>
#include <cmath>

namespace handloft::client {
namespace {

// Lengths of a grown hand (about the 50th percentile), metres.
constexpr std::size_t fingers = 4;  ///< Beside the thumb.
/// From a stretched finger's tip to its knuckle.
constexpr std::array<float, fingers> finger_length{0.082F, 0.090F, 0.085F, 0.068F};
constexpr float knuckle_spacing = 0.0195F, knuckle_drop = 0.010F;
constexpr float curled_forward = 0.012F,
                curled_lift = 0.034F;  ///< Of the knuckle from a curled finger's tip.
constexpr float palm_length = 0.085F, arm_length = 0.075F;
constexpr float wrist_spacing = 0.011F;
constexpr float thumb_root_back = 0.052F, thumb_root_aside = 0.030F, thumb_root_drop = 0.012F;
constexpr float highest_joint = 0.032F;
constexpr float tip_radius = 0.0068F, knuckle_radius = 0.0085F, thumb_radius = 0.0078F,
                thumb_root_radius = 0.012F;
constexpr float palm_radius = 0.0115F, wrist_radius = 0.0150F, arm_radius = 0.024F;
/// What the arm's side counts beside the thumb's: decides when thumb and fingers pinch.
constexpr float arm_weight = 0.022F;
constexpr float arm_certainty = 0.0F;
constexpr std::size_t least_fingers_for_palm = 2;

constexpr float smoothing_m = 0.0028F;  ///< k of the smooth minimum: a crease between fingers, no web.
constexpr float too_far = 8.0F;         ///< In k: exp(-8) counts for nothing.
constexpr int sides = 12, cap_rings = 3, body_rings = 4, newton_steps = 4;
constexpr float shortest = 1e-6F;

bool finite(const glm::vec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

glm::vec3 unit_or(const glm::vec3& v, const glm::vec3& otherwise) {
  const float length = glm::length(v);
  return length > shortest ? v / length : otherwise;
}

/// Across the hand from the index to the little finger, towards the wrist, and out of the hand's back.
struct HandAxes {
  glm::vec3 across, back, normal;
};

float offset_of(std::size_t finger) {
  return (static_cast<float>(finger) - 1.5F) * knuckle_spacing;
}

bool curled(std::size_t finger, HandPosture posture) {
  return posture == HandPosture::closed || (posture == HandPosture::pointing && finger != 0);
}

HandAxes axes_of(std::span<const std::optional<HandTip>> tips, const glm::vec3& middle, const glm::vec3& arm,
                 HandPosture posture) {
  const glm::vec3 up(0.0F, 0.0F, 1.0F);
  const HandTip* first = nullptr;
  const HandTip* last = nullptr;
  for (std::size_t i = 1; i < tips.size(); ++i) {
    if (!tips[i]) continue;
    if (first == nullptr) first = &*tips[i];
    last = &*tips[i];
  }
  HandAxes axes;
  axes.across = unit_or(glm::cross(-arm, up), glm::vec3(1.0F, 0.0F, 0.0F));
  if (first != nullptr && last != first) axes.across = unit_or(last->place - first->place, axes.across);
  glm::vec3 back = arm_weight * arm;
  // Of a flat hand the thumb's tip lies well towards the wrist; of a fist it says nothing.
  if (tips[0] && posture != HandPosture::closed && posture != HandPosture::pointing)
    back += tips[0]->place - middle;
  back -= glm::dot(back, axes.across) * axes.across;
  glm::vec3 plain = arm - glm::dot(arm, axes.across) * axes.across;
  axes.back = unit_or(back, unit_or(plain, glm::vec3(0.0F, -1.0F, 0.0F)));
  axes.normal = unit_or(glm::cross(axes.back, axes.across), up);
  if (axes.normal.z < 0.0F) axes.normal = -axes.normal;  // A left hand; palms seldom look up.
  return axes;
}

void add_finger(const HandTip& tip, const glm::vec3& knuckle, float length, bool bent, const HandAxes& axes,
                std::vector<Bone>& bones) {
  const float reach = glm::distance(tip.place, knuckle);
  const float rise =
      std::clamp(0.5F * std::sqrt(std::max(length * length - reach * reach, 0.0F)), 0.004F, highest_joint);
  glm::vec3 joint = 0.5F * (tip.place + knuckle) + rise * axes.normal;
  if (bent) joint = knuckle - 0.030F * axes.back - 0.006F * axes.normal;
  const float middle_radius = 0.5F * (tip_radius + knuckle_radius);
  bones.push_back({tip.place, joint, tip_radius, middle_radius, tip.certainty, tip.certainty});
  bones.push_back({joint, knuckle, middle_radius, knuckle_radius, tip.certainty, tip.certainty});
}

struct Distance {
  float value;
  float share;  ///< Of the bone, where the nearest place is.
};

Distance distance_to(const Bone& bone, const glm::vec3& place) {
  const glm::vec3 along = bone.to - bone.from;
  const float squared = glm::dot(along, along);
  const float share =
      squared > 0.0F ? std::clamp(glm::dot(place - bone.from, along) / squared, 0.0F, 1.0F) : 0.0F;
  const float radius = bone.from_radius_m + share * (bone.to_radius_m - bone.from_radius_m);
  return {glm::distance(place, bone.from + share * along) - radius, share};
}

struct Field {
  float distance = 0.0F;
  glm::vec3 gradient{0.0F};
  float certainty = 0.0F;
};

Field field_at(std::span<const Bone> bones, const glm::vec3& place) {
  float nearest = std::numeric_limits<float>::max();
  for (const Bone& bone : bones) nearest = std::min(nearest, distance_to(bone, place).value);
  Field field;
  float weights = 0.0F;
  for (const Bone& bone : bones) {
    const Distance there = distance_to(bone, place);
    const float behind = (there.value - nearest) / smoothing_m;
    if (behind > too_far) continue;
    const float weight = std::exp(-behind);
    const glm::vec3 axis = bone.from + there.share * (bone.to - bone.from);
    weights += weight;
    field.gradient += weight * unit_or(place - axis, glm::vec3(0.0F, 0.0F, 1.0F));
    field.certainty +=
        weight * (bone.from_certainty + there.share * (bone.to_certainty - bone.from_certainty));
  }
  if (weights <= 0.0F) return field;
  field.distance = nearest - smoothing_m * std::log(weights);
  field.gradient /= weights;
  field.certainty /= weights;
  return field;
}

SkinVertex on_skin(std::span<const Bone> bones, glm::vec3 place) {
  Field field;
  for (int step = 0; step < newton_steps; ++step) {
    field = field_at(bones, place);
    const float slope = std::max(glm::dot(field.gradient, field.gradient), 0.05F);
    place -= field.distance / slope * field.gradient;
  }
  field = field_at(bones, place);
  return {place, unit_or(field.gradient, glm::vec3(0.0F, 0.0F, 1.0F)), field.certainty};
}

}  // namespace

HandShape estimate_hand(const HandTips& all_tips, HandPosture posture,
                        const std::optional<glm::vec3>& arm_from) {
  HandTips tips = all_tips;
  glm::vec3 sum(0.0F);
  std::size_t count = 0;
  float certainty = 0.0F;
  for (std::size_t i = 0; i < tips.size(); ++i) {
    if (tips[i] && !(finite(tips[i]->place) && std::isfinite(tips[i]->certainty))) tips[i].reset();
    if (!tips[i] || i == 0) continue;
    sum += tips[i]->place;
    certainty += std::clamp(tips[i]->certainty, 0.0F, 1.0F);
    ++count;
  }
  HandShape shape;
  if (count < least_fingers_for_palm) {
    for (const auto& tip : tips) {
      if (!tip) continue;
      shape.bones.push_back({tip->place, tip->place, tip_radius, tip_radius, tip->certainty, tip->certainty});
      shape.palm = tip->place;
    }
    return shape;
  }
  const glm::vec3 middle = sum / static_cast<float>(count);
  certainty /= static_cast<float>(count);
  glm::vec3 arm(0.0F, -1.0F, 0.25F);
  if (arm_from && finite(*arm_from)) arm = *arm_from - middle;
  arm = unit_or(arm, glm::vec3(0.0F, -1.0F, 0.0F));
  const HandAxes axes = axes_of(tips, middle, arm, posture);

  // Every finger says where the middle of the knuckles should be.
  glm::vec3 knuckles(0.0F);
  for (std::size_t i = 0; i < fingers; ++i) {
    if (!tips[i + 1]) continue;
    const glm::vec3& tip = tips[i + 1]->place;
    const glm::vec3 root = curled(i, posture)
                               ? tip - curled_forward * axes.back + curled_lift * axes.normal
                               : tip + 0.93F * finger_length[i] * axes.back + knuckle_drop * axes.normal;
    knuckles += root - offset_of(i) * axes.across;
  }
  knuckles /= static_cast<float>(count);
  const glm::vec3 wrist = knuckles + palm_length * axes.back;
  shape.palm = knuckles + 0.45F * palm_length * axes.back;
  shape.back = axes.back;
  for (std::size_t i = 0; i < fingers; ++i) {
    // Knuckles stand in an arch: the outer ones lie nearer to the wrist.
    const float out = std::abs(static_cast<float>(i) - 1.2F);
    const glm::vec3 knuckle =
        knuckles + offset_of(i) * axes.across + 0.004F * out * axes.back - 0.0015F * out * axes.normal;
    if (tips[i + 1])
      add_finger(*tips[i + 1], knuckle, finger_length[i], curled(i, posture), axes, shape.bones);
    const glm::vec3 root = wrist + (static_cast<float>(i) - 1.5F) * wrist_spacing * axes.across;
    shape.bones.push_back({knuckle, root, palm_radius, wrist_radius, certainty, certainty});
  }
  if (tips[0]) {
    const glm::vec3 root = knuckles + thumb_root_back * axes.back - thumb_root_aside * axes.across -
                           thumb_root_drop * axes.normal;
    const glm::vec3 joint = 0.45F * tips[0]->place + 0.55F * root - 0.008F * axes.across;
    const float seen = tips[0]->certainty;
    shape.bones.push_back({tips[0]->place, joint, thumb_radius, 0.0095F, seen, seen});
    shape.bones.push_back({joint, root, 0.0095F, thumb_root_radius, seen, seen});
    shape.bones.push_back({root, wrist, thumb_root_radius, wrist_radius, seen, certainty});
  }
  shape.bones.push_back({wrist, wrist + arm_length * unit_or(axes.back + 0.5F * arm, axes.back), 0.021F,
                         arm_radius, certainty, arm_certainty});
  return shape;
}

float skin_distance(std::span<const Bone> bones, const glm::vec3& place) {
  if (bones.empty()) return std::numeric_limits<float>::max();
  return field_at(bones, place).distance;
}

Skin make_skin(std::span<const Bone> bones) {
  Skin skin;
  constexpr int rings = 2 * cap_rings + body_rings;
  for (const Bone& bone : bones) {
    const auto first = static_cast<std::uint32_t>(skin.vertices.size());
    const glm::vec3 axis = unit_or(bone.to - bone.from, glm::vec3(0.0F, 0.0F, 1.0F));
    const glm::vec3 helper =
        std::abs(axis.z) < 0.9F ? glm::vec3(0.0F, 0.0F, 1.0F) : glm::vec3(0.0F, 1.0F, 0.0F);
    const glm::vec3 along = glm::normalize(glm::cross(helper, axis));
    const glm::vec3 across = glm::cross(axis, along);
    for (int ring = 0; ring < rings; ++ring) {
      // From pole to pole: a quarter turn over the first cap, then along, then the other cap.
      float lift = 0.0F, share = 0.0F;
      constexpr float quarter = 1.5707963F;
      if (ring < cap_rings) {
        lift = -quarter * (1.0F - static_cast<float>(ring) / cap_rings);
      } else if (ring < cap_rings + body_rings) {
        share = static_cast<float>(ring - cap_rings) / (body_rings - 1);
      } else {
        share = 1.0F;
        lift = quarter * static_cast<float>(ring - cap_rings - body_rings + 1) / cap_rings;
      }
      const float radius = bone.from_radius_m + share * (bone.to_radius_m - bone.from_radius_m);
      const glm::vec3 centre = bone.from + share * (bone.to - bone.from);
      for (int side = 0; side < sides; ++side) {
        const float turn = 4.0F * quarter * static_cast<float>(side) / sides;
        const glm::vec3 out = std::cos(turn) * along + std::sin(turn) * across;
        const glm::vec3 direction = std::cos(lift) * out + std::sin(lift) * axis;
        skin.vertices.push_back(on_skin(bones, centre + radius * direction));
      }
    }
    for (std::uint32_t ring = 0; ring + 1 < rings; ++ring) {
      for (std::uint32_t side = 0; side < sides; ++side) {
        const std::uint32_t next = (side + 1) % sides;
        const std::uint32_t a = first + ring * sides + side, b = first + ring * sides + next;
        skin.indices.insert(skin.indices.end(), {a, b, a + sides, a + sides, b, b + sides});
      }
    }
  }
  return skin;
}

}  // namespace handloft::client
