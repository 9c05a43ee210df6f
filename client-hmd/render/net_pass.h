#pragma once
// Control nets over surfaces (V3): the lines between neighbouring control points, and the points, both of one
// size on the screen. What of a net is behind something shines through faintly, since half of it always is.

#include <map>
#include <memory>
#include <string>

#include "client-hmd/mirror/control_net.h"
#include "client-hmd/render/frame.h"
#include "client-hmd/render/surface_pass.h"

namespace handloft::client {

class NetPass {
 public:
  static Result<NetPass> create();

  /// Over the bound picture, whose depth is that of everything drawn before. Uploads what is new. Nothing
  /// when `frame` shows no nets.
  void draw(const Frame& frame, const EyeUniforms& eye);

 private:
  struct Resident {
    std::shared_ptr<const ControlNet> net;
    GlVertexArray line_array, point_array;
    GlBuffer segments, points;
    GLsizei segment_count = 0, point_count = 0;
  };
  static void upload(Resident& resident, const std::shared_ptr<const ControlNet>& net);

  GlProgram lines_;
  GlProgram points_;
  std::map<std::string, Resident> residents_;
};

}  // namespace handloft::client
