#include "client-hmd/render/look.h"

#include <gtest/gtest.h>

#include <set>

#include "client-hmd/render/materials.h"

namespace handloft::client {
namespace {

TEST(Look, NamesGoThereAndBack_V3) {
  for (const auto& known : shadings()) {
    EXPECT_EQ(shading_named(known.name), known.choice);
    EXPECT_EQ(name_of(known.choice), known.name);
  }
  for (const auto& known : curvature_kinds()) {
    EXPECT_EQ(curvature_kind_named(known.name), known.choice);
    EXPECT_EQ(name_of(known.choice), known.name);
  }
  EXPECT_FALSE(shading_named("tiger"));
  EXPECT_FALSE(curvature_kind_named(""));
}

TEST(Look, KeysGoThroughAllAndComeBack) {
  std::set<Shading> seen;
  Shading shading = Shading::studio;
  do {
    seen.insert(shading);
    shading = next_shading(shading);
  } while (shading != Shading::studio && seen.size() < 100);
  EXPECT_EQ(seen.size(), shadings().size());
  EXPECT_EQ(next_curvature_kind(CurvatureKind::smallest), CurvatureKind::mean);

  SurfaceOverlays overlays;
  std::set<std::pair<bool, bool>> combinations;
  for (int i = 0; i < 4; ++i) {
    combinations.insert({overlays.wires, overlays.control_nets});
    overlays = next_overlays(overlays);
  }
  EXPECT_EQ(combinations.size(), 4U);
  EXPECT_EQ(overlays, SurfaceOverlays{});
}

TEST(Look, OverlaysComeAsAList) {
  EXPECT_EQ(overlays_named(""), SurfaceOverlays{});
  EXPECT_EQ(overlays_named("none"), SurfaceOverlays{});
  const auto two = overlays_named("net,wires");
  ASSERT_TRUE(two);
  EXPECT_TRUE(two->wires && two->control_nets);
  EXPECT_FALSE(two->isophotes);
  EXPECT_TRUE(overlays_named("isophotes")->isophotes);
  EXPECT_FALSE(overlays_named("wires,stripes"));
  EXPECT_FALSE(overlays_named("wires, net")) << "no blanks";
}

TEST(ShapeColours, AreKeptAndSharedByMirrorImages) {
  ShapeColours colours;
  const glm::vec3 side = colours.of("side").shell;
  const glm::vec3 top = colours.of("top").shell;
  EXPECT_NE(side, top);
  EXPECT_EQ(colours.of("side-mirror").shell, side);
  EXPECT_EQ(colours.of("top").shell, top) << "stays";
  colours.keep_only([](std::string_view name) { return name != "side"; });
  EXPECT_EQ(colours.of("other").shell, side) << "the first that is free";
  EXPECT_EQ(without_mirror("-mirror"), "-mirror");
  // With more shapes than colours they are shared evenly.
  for (int i = 0; i < 40; ++i) (void)colours.of("shape" + std::to_string(i));
  EXPECT_EQ(colours.of("top").shell, top);
}

TEST(ShapeColours, InksAreReadOnTheirShells) {
  ShapeColours colours;
  const auto light = [](const glm::vec3& c) { return glm::dot(c, glm::vec3(0.2126F, 0.7152F, 0.0722F)); };
  for (int i = 0; i < 8; ++i) {
    const ShapeColour colour = colours.of("shape" + std::to_string(i));
    // WCAG's contrast for graphics is 3.
    EXPECT_GT((light(colour.shell) + 0.05F) / (light(colour.ink) + 0.05F), 2.4F) << i;
  }
}

}  // namespace
}  // namespace handloft::client
