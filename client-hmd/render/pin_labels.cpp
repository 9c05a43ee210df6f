#include "client-hmd/render/pin_labels.h"

#include <algorithm>
#include <string>

namespace handloft::client {
namespace {

constexpr float nearest_m = 0.02F;
constexpr float label_px = 17.0F, reference_height_px = 720.0F;  ///< Of a picture so high.
constexpr float smallest_label_m = 0.005F;
constexpr float towards_eye_m = 0.012F;  ///< So that the surface that it is pinned to does not cut it.

}  // namespace

std::vector<SpaceLabel> pin_labels(std::span<const PinMark> pins, const EyeUniforms& eye) {
  std::vector<SpaceLabel> labels;
  for (const PinMark& pin : pins) {
    const float depth = -(eye.eye_from_world * glm::vec4(pin.place, 1.0F)).z;
    if (!(depth > nearest_m)) continue;
    SpaceLabel label;
    label.text = std::to_string(pin.number);
    label.height_m =
        std::max(label_px * eye.viewport_px.y / reference_height_px * depth / eye.focal_px, smallest_label_m);
    const glm::vec3 to_eye = glm::normalize(eye.position - pin.place);
    label.position = pin.place + towards_eye_m * to_eye;
    label.centred = true;
    label.edge = pin.colour;
    labels.push_back(std::move(label));
  }
  return labels;
}

}  // namespace handloft::client
