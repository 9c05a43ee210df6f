#pragma once
// Ghosts of other users (U1): a translucent hand in the user's colour, clear in the middle and firm at its
// edges, so that it says where the hand is and hides little; the head as a visor that shows where it looks;
// a frame about what the hand works on; and words that face us. Overlapping parts of all hands are one layer:
// the nearest, found in a picture of depths of their own.

#include <vector>

#include "client-hmd/render/frame.h"
#include "client-hmd/render/icon_pass.h"
#include "client-hmd/render/ribbon_pass.h"
#include "client-hmd/render/surface_pass.h"

namespace handloft::client {

/// Triangles of all ghosts, with the colour at every vertex.
struct GhostVertex {
  Vec3f position;
  Vec3f normal;
  float opacity = 1.0F;
  Vec3f colour;
};

/// Where the arm of somebody whose head is at `head` comes from: the right shoulder, about.
glm::vec3 shoulder_of(const RigidPose& head);

/// The visor of a head: a curved bar before the eyes with a band around. Pure.
std::vector<Bone> visor_bones(const RigidPose& head);

/// Names over heads (or hands), and by each hand what it does; nearest to the eye last.
std::vector<SpaceLabel> ghost_labels(const std::vector<GhostHint>& ghosts, const EyeUniforms& eye);

class GhostPass {
 public:
  static Result<GhostPass> create();

  /// Builds the ghosts' triangles and draws their depths for a picture of `width_px` x `height_px`. Leaves
  /// another framebuffer bound. Errors: resource_exhausted.
  Status prepare(const Frame& frame, const EyeUniforms& eye, int width_px, int height_px);
  /// `stage` weighted or peel: ghosts are never opaque all over.
  void draw(const EyeUniforms& eye, Stage stage) const;

 private:
  void upload(const std::vector<GhostVertex>& vertices, const std::vector<std::uint32_t>& indices);

  GlProgram program_;
  GlVertexArray array_;
  GlBuffer vertices_, indices_;
  GlTexture depth_;
  GlFramebuffer target_;
  int width_px_ = 0, height_px_ = 0;
  GLsizei count_ = 0;
};

}  // namespace handloft::client
