#pragma once
// A picture with a transparent background from two opaque ones: the same things drawn before black and before
// grey (Smith and Blinn, "Blue screen matting", SIGGRAPH 1996: the triangulation matte). Whatever a renderer
// blends, and in whatever order, what shines through is the share of the background in the difference.

#include "client-hmd/render/image.h"

namespace handloft::client {

/// Linear grey: below where bright light is rolled off, so that what comes out is what went in.
inline constexpr float matte_grey = 0.7F;

/// Colours are not premultiplied, as PNG has them. Errors: invalid_argument for pictures of different sizes.
Result<Image> difference_matte(const Image& before_black, const Image& before_grey);

}  // namespace handloft::client
