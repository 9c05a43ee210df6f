// Any text as a script of a camera path: a plan within its limits, whose every picture can be drawn, or an
// error.

#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "client-hmd/shots/shot_script.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace handloft::client;
  ShotLimits limits;
  limits.max_frames = 500;
  limits.max_keys = 50;
  const auto plan = parse_shot_script({reinterpret_cast<const char*>(data), size}, "fuzz.toml", limits);
  if (!plan) {
    if (plan.error().message.size() > 4096 || plan.error().field.size() > 512) std::abort();
    return 0;
  }
  if (plan->frames() > limits.max_frames) std::abort();
  const auto shot = Shot::settle(*plan, {{-0.1, -0.1, 0.0}, {0.2, 0.1, 0.1}});
  if (!shot) return 0;
  for (std::size_t i = 0; i < shot->frames(); ++i) {
    const ShotView view = shot->view(i);
    const handloft::client::Eye eye = view.camera.eye(plan->width_px, plan->height_px);
    const glm::dvec3& at = eye.world_from_eye.position;
    if (!std::isfinite(at.x + at.y + at.z) || !(view.camera.distance_m > 0.0) ||
        !check_pinhole(eye.pinhole)) {
      std::abort();
    }
  }
  return 0;
}
