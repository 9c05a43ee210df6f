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

/// How large clouds look that are thinned out where they lie many times over each other, against every point.
TEST_F(BlendRendering, FewerPointsOfALargeCloudLookAsAllOfThem_V3) {
  constexpr int width = 480, height = 300;
  const std::vector<test::BlendScene> scenes = test::blend_scenes();
  std::printf("%-22s %8s %7s %6s %6s\n", "large cloud", "pixels", "mean", "p99", "max");
  for (const int count : {30'000, 120'000}) {
    auto cloud = test::entity_named("cloud");
    cloud->points = test::cloud(count, {0.0F, 0.0F, 0.05F}, {0.07F, 0.05F, 0.03F}, 0.5, 0.98);
    Frame frame;
    frame.scene = test::scene_with({cloud});
    frame.eye = scenes.front().camera.eye(width, height);
    Frame empty = frame;
    empty.scene = nullptr;
    const Image nothing = draw(empty), all = draw(frame);  // draw() is for stills: every point, sorted.
    ASSERT_TRUE(renderer_->draw_offscreen(frame, {}).ok());
    const Image fewer = renderer_->read_canvas();
    const Differences found = differences(fewer, all, nothing);
    std::printf("%-22d %8zu %7.2f %6.0f %6.0f\n", count, found.pixels, found.mean, found.p99, found.max);
    EXPECT_GT(found.pixels, 1000U);
    EXPECT_GT(found.max, 0.0) << "some were left out";
    EXPECT_LE(found.mean, 4.0);
    EXPECT_LE(found.p99, 24.0);
    const Differences itself = differences(draw(frame), all, nothing);
    EXPECT_EQ(itself.max, 0.0) << "a still has every point, each time";
  }
}

}  // namespace
}  // namespace handloft::client
