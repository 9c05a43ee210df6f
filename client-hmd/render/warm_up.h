#pragma once
// Frames that nobody sees (V5): drivers make a program ready when it is first drawn with (in software that is
// tens of milliseconds each), and targets are allocated when they are first drawn into. Drawn before the
// first frame that is shown, these few hold something of everything that a later frame may hold, so that the
// first stroke, ghost or film does not make a frame long.

#include <vector>

#include "client-hmd/render/frame.h"

namespace handloft::client {

/// For pictures of that size.
std::vector<Frame> warm_up_frames(int width_px, int height_px);

}  // namespace handloft::client
