#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/codec/fingertips.h"

namespace handloft::codec {
namespace {

Fingertips five() {
  Fingertips tips;
  for (std::size_t i = 0; i < tips.size(); ++i) {
    const auto value = static_cast<float>(i);
    tips[i] = {v1::TRACKING_TRACKED,
               {0.1 * static_cast<double>(i), 1.0 / 3.0, -2.0},
               {value, 0.5F, -0.25F},
               {value, 1.F, 2.F, 3.F, 4.F, 5.F},
               static_cast<std::uint32_t>(i)};
  }
  return tips;
}

TEST(Fingertips, ComeBackAsTheyWerePacked_T14) {
  const Fingertips tips = five();
  v1::HandState hand;
  pack_fingertips(tips, hand);
  pack_fingertips(tips, hand);  // replaces, does not append
  const auto read = unpack_fingertips(hand);
  ASSERT_TRUE(read.ok());
  for (std::size_t i = 0; i < tips.size(); ++i) {
    EXPECT_EQ((*read)[i].state, tips[i].state);
    EXPECT_EQ((*read)[i].position_m, tips[i].position_m);
    EXPECT_EQ((*read)[i].velocity_m_s, tips[i].velocity_m_s);
    EXPECT_EQ((*read)[i].covariance_m2, tips[i].covariance_m2);
    EXPECT_EQ((*read)[i].camera_mask, tips[i].camera_mask);
  }
}

TEST(Fingertips, OfALostOneNothingIsTold_T6) {
  Fingertips tips = five();
  tips[3].state = v1::TRACKING_LOST;
  v1::HandState hand;
  pack_fingertips(tips, hand);
  const auto read = unpack_fingertips(hand);
  ASSERT_TRUE(read.ok());
  EXPECT_EQ((*read)[3].state, v1::TRACKING_LOST);
  EXPECT_EQ((*read)[3].position_m, (std::array<double, 3>{}));
  EXPECT_EQ((*read)[4].position_m, tips[4].position_m);
}

TEST(Fingertips, AHandWithoutThemHasThemLost) {
  const auto read = unpack_fingertips({});
  ASSERT_TRUE(read.ok());
  for (const FingertipRecord& tip : *read) EXPECT_EQ(tip.state, v1::TRACKING_LOST);
}

TEST(Fingertips, ListsOfTheWrongLengthAreNamed) {
  const auto refused_field = [](auto spoil) {
    v1::HandState hand;
    pack_fingertips(five(), hand);
    spoil(hand);
    const auto read = unpack_fingertips(hand);
    return read.ok() ? std::string("accepted") : read.error().field;
  };
  EXPECT_EQ(refused_field([](v1::HandState& hand) { hand.add_fingertip_states(v1::TRACKING_LOST); }),
            "fingertip_states");
  EXPECT_EQ(refused_field([](v1::HandState& hand) { hand.mutable_fingertip_positions()->Truncate(14); }),
            "fingertip_positions");
  EXPECT_EQ(refused_field([](v1::HandState& hand) { hand.clear_fingertip_positions(); }),
            "fingertip_positions");
  EXPECT_EQ(refused_field([](v1::HandState& hand) { hand.add_fingertip_velocities(0.F); }),
            "fingertip_velocities");
  EXPECT_EQ(refused_field([](v1::HandState& hand) { hand.add_fingertip_covariances(0.F); }),
            "fingertip_covariances");
  EXPECT_EQ(refused_field([](v1::HandState& hand) { hand.add_fingertip_camera_masks(0); }),
            "fingertip_camera_masks");
  EXPECT_EQ(refused_field([](v1::HandState& hand) { hand.clear_fingertip_covariances(); }), "accepted");
}

}  // namespace
}  // namespace handloft::codec
