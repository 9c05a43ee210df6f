#pragma once
// The shape of a hand of which only fingertips are known: bones are guessed from how far a finger reaches and
// where the arm comes from, and a skin is laid around them: the level set of a smooth minimum of the bones'
// distances (Quilez, "smooth minimum": -k log sum exp(-d/k)), so that fingers grow out of the palm without
// seams. For ghosts of other users and for the hand that hides what is behind it in film. Pure: no OpenGL
// here. World frame, metres.

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

#include "client-hmd/mirror/hand_mark.h"

namespace handloft::client {

/// A fingertip that is known somehow.
struct HandTip {
  glm::vec3 place{0.0F};
  float certainty = 1.0F;  ///< 1: seen; 0: nothing.
};
/// Thumb to little finger.
using HandTips = std::array<std::optional<HandTip>, tips_of_a_hand>;

/// A ball that swells or shrinks on its way.
struct Bone {
  glm::vec3 from{0.0F}, to{0.0F};
  float from_radius_m = 0.0F, to_radius_m = 0.0F;
  float from_certainty = 1.0F, to_certainty = 1.0F;  ///< 0: fades away, as an arm does.
};

/// What was guessed: bones, and where words about the hand may stand.
struct HandShape {
  std::vector<Bone> bones;
  glm::vec3 palm{0.0F};
  glm::vec3 back{0.0F, -1.0F, 0.0F};  ///< Unit: from the fingers to the wrist.
};

/// `arm_from`: where the arm comes from, about the owner's shoulders; without it the designer's side (-y).
/// Fewer than two fingers beside the thumb make no palm: then there are just the tips. Tips that are not
/// finite are passed over.
HandShape estimate_hand(const HandTips& tips, HandPosture posture,
                        const std::optional<glm::vec3>& arm_from = std::nullopt);

struct SkinVertex {
  glm::vec3 position{0.0F};
  glm::vec3 normal{0.0F, 0.0F, 1.0F};  ///< Unit, outwards.
  float certainty = 1.0F;
};

struct Skin {
  std::vector<SkinVertex> vertices;
  std::vector<std::uint32_t> indices;  ///< Three a triangle; some lie on each other where bones meet.
};

/// The skin's level set as a signed distance, about: below 0 inside.
float skin_distance(std::span<const Bone> bones, const glm::vec3& place);

/// Some 150 vertices a bone, all on the level set.
Skin make_skin(std::span<const Bone> bones);

}  // namespace handloft::client
