#pragma once
// Order-independent transparency (V2): McGuire and Bavoil, "Weighted Blended Order-Independent Transparency",
// JCGT 2013. One pass sums premultiplied colours with a weight that falls with depth; the resolve divides by
// the sum of weights. Exact for one layer; for more it is an average in favour of what is near. Surfaces are
// blended first and the points over them, since ink just before a nearly opaque layer is where the average
// errs most. Of surfaces the nearest layer is peeled and blended exactly, and only the rest is averaged, with
// weights that fall from that layer on. Depth peeling is the reference.
//
// The weight of points falls by a factor e every `falloff_m`, so that in a scene of a few decimetres the
// front layer wins, and is clamped such that 500 opaque layers stay below the largest half float (65504).

#include <algorithm>
#include <cmath>

namespace handloft::client {

enum class Transparency {
  weighted_blended,
  depth_peeling,  ///< Exact, up to max_peeled_layers; for tests and stills.
};

struct TransparencyWeights {
  float reference_m = 0.5F;  ///< Depth of weight 1: an arm's length. Of surfaces: behind the nearest layer.
  float falloff_m = 0.05F;   ///< The thickness of a typical shape.
  float smallest = 1e-3F;    ///< Far layers still count where nothing is before them.
  float largest = 100.0F;
};

/// Behind the nearest layer of surfaces: these are skins, so the next one hides most, however near.
inline constexpr TransparencyWeights weights_of_surfaces{
    .reference_m = 0.0F, .falloff_m = 0.01F, .smallest = 1e-4F, .largest = 1.0F};

inline constexpr int max_peeled_layers = 128;  ///< It ends with the last layer that is not empty.

/// Weight of a layer of opacity `alpha` at `eye_depth_m`; the shaders hold the same formula.
inline float transparency_weight(float alpha, float eye_depth_m, const TransparencyWeights& weights = {}) {
  const float depth = std::exp(-(eye_depth_m - weights.reference_m) / weights.falloff_m);
  return alpha * std::clamp(depth, weights.smallest, weights.largest);
}

}  // namespace handloft::client
