#pragma once
// Tests that look at pictures of the real renderer, drawn on EGL without a display.

#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>
#include <string>

#include "client-hmd/render/offscreen_context.h"
#include "client-hmd/render/renderer.h"
#include "client-hmd/view/orbit_camera.h"

namespace handloft::client::test {

class Rendering : public testing::Test {
 protected:
  void SetUp() override {
    Result<std::unique_ptr<OffscreenContext>> context = OffscreenContext::create();
    ASSERT_TRUE(context.ok()) << context.error().describe();
    context_ = std::move(*context);
    Result<std::unique_ptr<Renderer>> renderer = Renderer::create();
    ASSERT_TRUE(renderer.ok()) << renderer.error().describe();
    renderer_ = std::move(*renderer);
  }
  void TearDown() override {
    renderer_.reset();
    context_.reset();
  }

  Image draw(const Frame& frame, const RenderOptions& options = {}) {
    Result<Image> image = renderer_->draw_to_image(frame, options);
    EXPECT_TRUE(image.ok()) << image.error().describe();
    return image.ok() ? *image : Image{};
  }

  static Frame frame_of(std::shared_ptr<const Scene> scene, int width = 480, int height = 270) {
    Frame frame;
    frame.scene = std::move(scene);
    frame.eye = OrbitCamera().eye(width, height);
    return frame;
  }

  /// Against tests/data/golden/NAME.png; drivers round the edges of triangles differently.
  static void expect_golden(const Image& picture, const std::string& name) {
    const std::string path = "tests/data/golden/" + name + ".png";
    if (std::getenv("HANDLOFT_UPDATE_GOLDEN") != nullptr) {
      ASSERT_TRUE(write_png(path, picture).ok());
      GTEST_SKIP() << "wrote " << path << "; look at it before it is committed";
    }
    const Result<Image> golden = read_png(path);
    ASSERT_TRUE(golden.ok()) << golden.error().describe();
    const double difference = *mean_absolute_difference(picture, *golden);
    const double similarity = *structural_similarity(picture, *golden);
    if (difference > 1.5 || similarity < 0.98) (void)write_png("build/" + name + "_failed.png", picture);
    EXPECT_LT(difference, 1.5);
    EXPECT_GT(similarity, 0.98);
  }

  std::unique_ptr<OffscreenContext> context_;
  std::unique_ptr<Renderer> renderer_;
};

}  // namespace handloft::client::test
