// Weighted blending against depth peeling (V2) on scenes of many kinds, as a table: what it costs to need no
// order.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "tests/integration/client-hmd/blend_scenes.h"
#include "tests/integration/client-hmd/rendering_fixture.h"

namespace handloft::client {
namespace {

struct Differences {
  double mean = 0.0, p99 = 0.0, max = 0.0;
  std::size_t pixels = 0;
};

/// Largest channel's difference, over the pixels where `reference` differs from `empty`.
Differences differences(const Image& image, const Image& reference, const Image& empty) {
  std::vector<int> found;
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
    int difference = 0, something = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      difference = std::max(difference, std::abs(image.rgba[i + c] - reference.rgba[i + c]));
      something = std::max(something, std::abs(reference.rgba[i + c] - empty.rgba[i + c]));
    }
    if (something > 1 || difference > 1) found.push_back(difference);
  }
  Differences result;
  result.pixels = found.size();
  if (found.empty()) return result;
  std::sort(found.begin(), found.end());
  for (const int one : found) result.mean += one;
  result.mean /= static_cast<double>(found.size());
  result.p99 = found[found.size() * 99 / 100];
  result.max = found.back();
  return result;
}

using BlendRendering = test::Rendering;

TEST_F(BlendRendering, WeightedBlendingIsNearPeelingInEveryKindOfScene_V2) {
  constexpr int width = 480, height = 300;
  RenderOptions peeled;
  peeled.transparency = Transparency::depth_peeling;
  std::printf("%-22s %8s %7s %6s %6s\n", "scene", "pixels", "mean", "p99", "max");
  for (const test::BlendScene& scene : test::blend_scenes()) {
    SCOPED_TRACE(scene.name);
    Frame frame = scene.frame;
    frame.eye = scene.camera.eye(width, height);
    Frame empty = frame;
    empty.scene = nullptr;
    empty.ghosts.clear();
    empty.symmetry.reset();
    empty.fingers.clear();
    const Differences found = differences(draw(frame), draw(frame, peeled), draw(empty));
    std::printf("%-22s %8zu %7.2f %6.0f %6.0f\n", scene.name.c_str(), found.pixels, found.mean, found.p99,
                found.max);
    EXPECT_GT(found.pixels, 1000U) << "there is something to blend";
    EXPECT_LE(found.mean, scene.most_mean);
    EXPECT_LE(found.p99, scene.most_p99);
    EXPECT_LE(found.max, scene.most_max);
  }
}

}  // namespace
}  // namespace handloft::client
