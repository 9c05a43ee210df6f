// Other users' hands and heads (U1), and our own in film (V1), in pictures of the real renderer.

#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/integration/client-hmd/ghost_scene.h"
#include "tests/integration/client-hmd/rendering_fixture.h"
#include "tests/integration/client-hmd/synthetic_scene.h"

namespace handloft::client {
namespace {

class GhostRendering : public test::Rendering {
 protected:
  static constexpr int width = 480, height = 300;

  Frame with(std::vector<GhostHint> ghosts, std::shared_ptr<const Scene> scene = nullptr) {
    Frame frame = frame_of(std::move(scene), width, height);
    frame.ghosts = std::move(ghosts);
    return frame;
  }
  double difference(const Frame& a, const Frame& b) { return *mean_absolute_difference(draw(a), draw(b)); }
};

TEST_F(GhostRendering, Show) {
  RenderOptions still;
  still.supersampling = 2;
  Frame frame = frame_of(test::synthetic_scene(), 1280, 720);
  frame.ghosts = {test::anna(), test::bo()};
  (void)write_png("/tmp/ghosts/a.png", draw(frame, still));
  OrbitCamera near;
  near.target = {0.03, 0.05, 0.08};
  near.distance_m = 0.45;
  near.azimuth_rad = -0.6;
  near.elevation_rad = 0.4;
  frame.eye = near.eye(1280, 720);
  (void)write_png("/tmp/ghosts/b.png", draw(frame, still));
}

}  // namespace
}  // namespace handloft::client
