#pragma once
// Colours for curvature: diverging, from blue (hollow) over a pale grey to a brick red (bulging). Mixed in
// Oklab (Ottosson 2020), so that equal steps of curvature are equal steps to the eye, with equal lightness on
// both sides; blue and orange-red remain apart with all usual colour vision deficiencies.

#include <glm/glm.hpp>
#include <string>
#include <string_view>

#include "client-hmd/render/colours.h"
#include "client-hmd/render/frame.h"
#include "client-hmd/render/look.h"

namespace handloft::client {

/// Linear RGB at `share` of the range, -1..1; beyond, and for NaN, as at the ends and nought.
glm::vec3 curvature_colour(const DivergingRamp& ramp, float share);

/// A curvature as a designer says it: as a radius, "R 50 mm", "R 1.2 m", hollow with a minus; "flat" for what
/// is less than 1/km.
std::string radius_words(float curvature_per_m);

/// A bar at the right edge, with what it means, in pixels of the picture; text as high as the HUD's.
/// `range_per_m`: at the ends.
void add_curvature_legend(CurvatureKind kind, float range_per_m, const DivergingRamp& ramp, int width_px,
                          int height_px, Overlay& overlay);

}  // namespace handloft::client
