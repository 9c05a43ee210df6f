// Notices come newest first, fade, and never pile up (V7).

#include "client-hmd/hud/notices.h"

#include <gtest/gtest.h>

namespace handloft::client {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr TimePoint start{seconds(100)};

TEST(Notices, ComeNewestFirstAndFade) {
  Notices notices;
  notices.tell(NoticeKind::done, "Exported", start);
  notices.tell(NoticeKind::refused, "Fit: too few points", start + seconds(1));
  auto seen = notices.visible(start + seconds(1));
  ASSERT_EQ(seen.size(), 2U);
  EXPECT_EQ(seen[0].words, "Fit: too few points");
  EXPECT_EQ(seen[1].opacity, 1.0F);
  seen = notices.visible(start + seconds(8) + milliseconds(300));
  ASSERT_EQ(seen.size(), 2U);
  EXPECT_NEAR(seen[1].opacity, 0.5F, 1e-3F) << "half of its fading is over";
  EXPECT_EQ(notices.visible(start + seconds(10)).size(), 1U) << "what was refused stays longer";
  EXPECT_TRUE(notices.visible(start + seconds(60)).empty());
  EXPECT_EQ(notices.all().size(), 2U);
}

TEST(Notices, CountTheSameWordsInsteadOfRepeatingThem) {
  Notices notices;
  for (int i = 0; i < 5; ++i) notices.tell(NoticeKind::refused, "Nothing to undo", start + seconds(i));
  ASSERT_EQ(notices.visible(start + seconds(4)).size(), 1U);
  EXPECT_EQ(notices.visible(start + seconds(4))[0].times, 5);
  EXPECT_FALSE(notices.visible(start + seconds(19)).empty()) << "shown anew with the last one";
}

TEST(Notices, AreBounded) {
  Notices notices;
  for (int i = 0; i < 1000; ++i) notices.tell(NoticeKind::done, std::to_string(i), start);
  EXPECT_EQ(notices.all().size(), 50U);
  EXPECT_EQ(notices.visible(start).size(), 4U);
  EXPECT_EQ(notices.visible(start)[0].words, "999");
  notices.tell(NoticeKind::done, std::string(100'000, 'x'), start);
  EXPECT_LE(notices.all()[0].words.size(), 410U);
  notices.tell(NoticeKind::done, "", start);
  EXPECT_NE(notices.all()[0].words, "");
}

TEST(Notices, ArePutAwayByAClick) {
  Notices notices;
  for (const char* words : {"a", "b", "c"}) notices.tell(NoticeKind::done, words, start);
  notices.dismiss(1, start);
  const auto seen = notices.visible(start);
  ASSERT_EQ(seen.size(), 2U);
  EXPECT_EQ(seen[0].words, "c");
  EXPECT_EQ(seen[1].words, "a");
  notices.dismiss(99, start);
  EXPECT_EQ(notices.visible(start).size(), 2U);
}

}  // namespace
}  // namespace handloft::client
