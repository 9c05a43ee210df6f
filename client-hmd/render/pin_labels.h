#pragma once
// The numbers of comments where they are pinned (U6), facing the eye, with a rim in their author's colour.

#include <span>
#include <vector>

#include "client-hmd/render/frame.h"
#include "client-hmd/render/icon_pass.h"

namespace handloft::client {

/// Those behind the eye are left out.
std::vector<SpaceLabel> pin_labels(std::span<const PinMark> pins, const EyeUniforms& eye);

}  // namespace handloft::client
