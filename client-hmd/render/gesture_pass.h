#pragma once
// What hangs in the air while a hand works: the modification disk with its normal and, around it, the range
// of its influence (A13, A16); the stroke being drawn (A18, A24); brackets about the shape that a gesture
// would act on (A25), and, in their colours, about what others work on (dashed) and hold
// (whole). Drawn over the finished picture: what
// stands behind something shines through faintly, since a hand works inside its shapes.

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "client-hmd/render/frame.h"
#include "client-hmd/render/icon_pass.h"
#include "client-hmd/render/ribbon_pass.h"

namespace handloft::client {

/// The smallest box along the axes that holds what `entity` shows; nullopt when it shows nothing.
struct Box {
  glm::vec3 low{0.0F}, high{0.0F};
};
std::optional<Box> shown_box(const Entity& entity);

class GesturePass {
 public:
  static Result<GesturePass> create();

  /// Looks anew which shapes are targets or somebody's gesture.
  void update(const Scene& scene);
  /// Into the bound picture, whose depth is that of everything drawn before.
  void draw(const Frame& frame, const EyeUniforms& eye);
  /// Over each shape that somebody holds, that user's name; nearest to the eye last.
  std::vector<SpaceLabel> holder_labels(const Frame& frame, const EyeUniforms& eye);

 private:
  void draw_disks(std::span<const DiskHint> disks, const EyeUniforms& eye, float opacity) const;
  void add_frames(const Frame& frame, Ribbons& out);
  /// Of an entity of the present scene; looked for once a state of it.
  const std::optional<Box>& box_of(const std::shared_ptr<const Entity>& entity);

  GlProgram disk_;
  GlVertexArray no_vertices_;
  RibbonPass ribbons_;
  std::vector<std::shared_ptr<const Entity>> targets_, provisional_;
  struct KnownBox {
    std::shared_ptr<const Entity> entity;
    std::optional<Box> box;
  };
  std::map<std::string, KnownBox> boxes_;
};

}  // namespace handloft::client
