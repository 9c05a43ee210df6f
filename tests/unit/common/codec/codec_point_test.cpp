// Fuzzy points on the wire (A1 to A3): round trips, tails, and hostile messages.

#include <gmock/gmock.h>

#include <limits>

#include "common/codec/point_codec.h"

namespace handloft::codec {
namespace {

FuzzyStyle style(double pressure) {
  return {pressure, 0.01F, {0.01F, 0.008F, 0.006F, 0.004F, 0.002F}, {0.1F, 0.2F, 0.3F, 0.4F, 0.5F}};
}

PointTail three() {
  return {3,
          0,
          {{0.0, 0.0, 0.0}, {0.1234567, -0.2, 1e-6}, {-1.5, 2.25, 0.75}},
          {0, 1, 0},
          {style(0.25), style(1.0)}};
}

TEST(PointCodecTest, positions_come_back_within_half_a_micrometre) {
  const auto back = decode_points(*encode_points(three()));
  ASSERT_TRUE(back.ok()) << back.error().describe();
  EXPECT_NEAR(back->positions[1][0], 0.1234567, 0.5e-6);
  EXPECT_NEAR(back->positions[1][2], 1e-6, 1e-12);  // a whole step is exact
  EXPECT_EQ(back->styles, three().styles);
  EXPECT_EQ(back->palette, three().palette);
}

TEST(PointCodecTest, a_tail_is_appended_and_its_styles_are_united) {
  PointTail held = three();
  const PointTail tail{5, 3, {{1, 1, 1}, {2, 2, 2}}, {0, 1}, {style(0.5), style(1.0)}};
  ASSERT_TRUE(merge_points(held, tail).ok());
  EXPECT_EQ(held.total, 5U);
  EXPECT_EQ(held.positions[4], (std::array<double, 3>{2, 2, 2}));
  ASSERT_EQ(held.palette.size(), 3U);
  EXPECT_EQ(held.palette[held.styles[3]].pressure, 0.5);
  EXPECT_EQ(held.palette[held.styles[4]].pressure, 1.0);
  ASSERT_TRUE(merge_points(held, {1, 1, {}, {}, {}}).ok());  // back to one point
  EXPECT_EQ(held.positions.size(), 1U);
}

TEST(PointCodecTest, a_tail_beyond_what_is_held_is_refused_and_changes_nothing) {
  PointTail held = three();
  EXPECT_EQ(merge_points(held, {5, 4, {{1, 1, 1}}, {0}, {style(0.5)}}).error().field, "first");
  EXPECT_EQ(held.positions.size(), 3U);
  EXPECT_EQ(held.palette.size(), 2U);
}

TEST(PointCodecTest, the_encoder_names_what_is_wrong) {
  PointTail tail = three();
  tail.positions[2][1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(encode_points(tail).error().field, "positions[2][1]");
  tail = three();
  tail.styles[1] = 2;
  EXPECT_EQ(encode_points(tail).error().field, "styles[1]");
  tail = three();
  tail.positions[0][0] = 3000.0;  // beyond 32 bits of micrometres
  EXPECT_EQ(encode_points(tail).error().field, "positions[0][0]");
  EXPECT_EQ(encode_points(three(), {.step_m = 0.0}).error().field, "step_m");
}

TEST(PointCodecTest, the_decoder_names_what_is_wrong) {
  const v1::PointCloud good = *encode_points(three());
  const auto field = [](const v1::PointCloud& message) {
    const auto result = decode_points(message);
    return result.ok() ? std::string("accepted") : result.error().field;
  };
  v1::PointCloud message = good;
  ASSERT_EQ(field(message), "accepted");
  message.set_total(0xffffffffU);
  EXPECT_EQ(field(message), "total");
  message = good;
  message.set_total(1000);  // no bytes for them
  EXPECT_EQ(field(message), "positions");
  message = good;
  message.set_first(4);
  EXPECT_EQ(field(message), "first");
  message = good;
  message.mutable_styles()->pop_back();
  EXPECT_EQ(field(message), "styles");
  message = good;
  message.mutable_styles()->at(2) = 9;
  EXPECT_EQ(field(message), "styles[1]");
  message = good;
  message.mutable_palette(0)->set_pressure(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(field(message), "palette[0].pressure");
  message = good;
  message.mutable_palette(1)->mutable_shell_alpha()->RemoveLast();
  EXPECT_EQ(field(message), "palette[1]");
  message = good;
  message.set_step_m(std::numeric_limits<double>::infinity());
  EXPECT_EQ(field(message), "step_m");
  message = good;
  message.mutable_origin()->set_x(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(field(message), "positions[0][0]");
}

}  // namespace
}  // namespace handloft::codec
