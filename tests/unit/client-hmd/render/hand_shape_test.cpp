// A hand guessed from its fingertips: near the tips, of a hand's size, whole, and never anything but numbers.

#include "client-hmd/render/hand_shape.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace handloft::client {
namespace {

HandTips right_hand() {
  const auto tip = [](float x, float y) { return HandTip{{x, y, 0.1F}, 1.0F}; };
  return {tip(-0.06F, -0.055F), tip(-0.03F, -0.005F), tip(-0.008F, 0.006F), tip(0.015F, 0.0F),
          tip(0.038F, -0.02F)};
}

TEST(HandShape, ReachesFromTheTipsTowardsTheWrist_U1) {
  const HandTips tips = right_hand();
  const HandShape hand = estimate_hand(tips, HandPosture::open);
  for (const auto& tip : tips) {
    EXPECT_LT(skin_distance(hand.bones, tip->place), 0.0F) << "tips are inside of their fingers";
  }
  EXPECT_LT(hand.back.y, -0.8F) << "the thumb lies nearer to the wrist, and the arm comes from -y";
  EXPECT_NEAR(hand.palm.x, 0.0F, 0.025F);
  EXPECT_NEAR(hand.palm.y, -0.12F, 0.03F) << "a finger and half a palm behind the tips";
  EXPECT_LT(skin_distance(hand.bones, hand.palm), 0.0F);
  EXPECT_GT(skin_distance(hand.bones, {0.0F, 0.1F, 0.1F}), 0.05F) << "nothing before the fingers";
}

TEST(HandShape, TurnsWithItsTips) {
  HandTips turned = right_hand();
  for (auto& tip : turned)
    tip->place = {-tip->place.y, tip->place.x, tip->place.z};  // A quarter turn about z.
  const HandShape hand = estimate_hand(turned, HandPosture::open, glm::vec3(0.5F, 0.0F, 0.2F));
  EXPECT_GT(hand.back.x, 0.8F);
}

TEST(HandShape, TheArmDecidesWhereThumbAndFingersPinch) {
  HandTips pinch = right_hand();
  pinch[0]->place = pinch[1]->place + glm::vec3(0.0F, 0.01F, 0.0F);
  const HandShape towards = estimate_hand(pinch, HandPosture::open, glm::vec3(0.0F, -0.5F, 0.2F));
  const HandShape away = estimate_hand(pinch, HandPosture::open, glm::vec3(0.0F, 0.6F, 0.2F));
  EXPECT_LT(towards.back.y, -0.5F);
  EXPECT_GT(away.back.y, 0.5F);
}

TEST(HandShape, SkinLiesOnTheLevelSetWithUnitNormals) {
  const HandShape hand = estimate_hand(right_hand(), HandPosture::open);
  const Skin skin = make_skin(hand.bones);
  ASSERT_GT(skin.vertices.size(), 500U);
  ASSERT_EQ(skin.indices.size() % 3, 0U);
  int off = 0;
  for (const SkinVertex& vertex : skin.vertices) {
    EXPECT_NEAR(glm::length(vertex.normal), 1.0F, 1e-3F);
    if (std::abs(skin_distance(hand.bones, vertex.position)) > 5e-4F) ++off;
  }
  EXPECT_LT(off, static_cast<int>(skin.vertices.size() / 50))
      << "half a millimetre, for all but a few in creases";
  for (const std::uint32_t index : skin.indices) EXPECT_LT(index, skin.vertices.size());
}

TEST(HandShape, TheArmFadesAndUnsureTipsMakeUnsureBones) {
  HandTips tips = right_hand();
  for (auto& tip : tips) tip->certainty = 0.4F;
  const HandShape hand = estimate_hand(tips, HandPosture::open);
  for (const Bone& bone : hand.bones)
    EXPECT_LE(std::max(bone.from_certainty, bone.to_certainty), 0.4F + 1e-6F);
  EXPECT_FLOAT_EQ(hand.bones.back().to_certainty, 0.0F);
}

TEST(HandShape, FewOrBadTipsMakeNoPalm) {
  EXPECT_TRUE(estimate_hand({}, HandPosture::open).bones.empty());
  HandTips one;
  one[1] = HandTip{{0.1F, 0.0F, 0.1F}, 1.0F};
  EXPECT_EQ(estimate_hand(one, HandPosture::open).bones.size(), 1U);
  HandTips bad = right_hand();
  bad[1]->place.x = std::numeric_limits<float>::quiet_NaN();
  bad[2]->place.y = std::numeric_limits<float>::infinity();
  for (const HandPosture posture : {HandPosture::open, HandPosture::closed, HandPosture::pointing}) {
    for (const SkinVertex& vertex : make_skin(estimate_hand(bad, posture).bones).vertices) {
      ASSERT_TRUE(std::isfinite(vertex.position.x + vertex.position.y + vertex.position.z));
      ASSERT_TRUE(std::isfinite(vertex.normal.x + vertex.normal.y + vertex.normal.z + vertex.certainty));
    }
  }
  HandTips same;  // All in one place: no direction can be told.
  for (auto& tip : same) tip = HandTip{{0.0F, 0.0F, 0.1F}, 1.0F};
  for (const SkinVertex& vertex :
       make_skin(estimate_hand(same, HandPosture::open, glm::vec3(0, 0, 0.1F)).bones).vertices) {
    ASSERT_TRUE(std::isfinite(vertex.position.x + vertex.position.y + vertex.position.z));
  }
}

TEST(HandShape, AFistIsShorterThanAnOpenHand) {
  const auto reach = [](HandPosture posture) {
    float far = 0.0F;
    const HandShape hand = estimate_hand(right_hand(), posture, glm::vec3(0.0F, -0.5F, 0.3F));
    for (const Bone& bone : hand.bones) far = std::max(far, -bone.from.y);
    return far;
  };
  EXPECT_LT(reach(HandPosture::closed) + 0.03F, reach(HandPosture::open));
}

}  // namespace
}  // namespace handloft::client
