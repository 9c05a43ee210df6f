#pragma once
// Colours for signed distances (A28): diverging, blue for negative, light grey for nought, orange for
// positive, which people with any of the usual colour vision deficiencies tell apart (Brewer's PuOr and RdBu
// share these ends). The renderer and the HUD's legend take them from here.

#include <glm/glm.hpp>

namespace handloft::client {

/// The ends of the scale stand for this distance on either side; what is farther has their colours.
struct DistanceScale {
  float range_m = 0.005F;  ///< What is beyond is far off for a hand-held thing; a millimetre still shows.
};

/// Linear RGB.
struct DistanceColours {
  glm::vec3 negative{0.018F, 0.133F, 0.445F};
  glm::vec3 nought{0.730F, 0.730F, 0.730F};
  glm::vec3 positive{0.790F, 0.200F, 0.008F};
};

/// Linear RGB at `share` of the range, -1..1; beyond, and for NaN, as at the ends and nought.
glm::vec3 distance_colour(float share, const DistanceColours& colours = {});

/// The same for what is drawn after the encoding: sRGB (IEC 61966-2-1), opaque.
glm::vec4 distance_colour_srgb(float share);

}  // namespace handloft::client
