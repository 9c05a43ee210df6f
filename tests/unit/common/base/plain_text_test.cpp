#include "common/base/plain_text.h"

#include <gtest/gtest.h>

namespace handloft {
namespace {

TEST(PlainText, IsCutBetweenCharacters) {
  EXPECT_EQ(plain_text("grün", 10), "grün");
  EXPECT_EQ(plain_text("grün", 5), "grün");
  EXPECT_EQ(plain_text("grün", 4), "grü");
  EXPECT_EQ(plain_text("grün", 3), "gr") << "not half of a character";
  EXPECT_EQ(plain_text("grün", 0), "");
  EXPECT_EQ(plain_text("", 7), "");
  EXPECT_EQ(plain_text("\x80\x80\x80", 2), "") << "what is no text at all";
}

TEST(PlainText, MovesNoCursor) {
  EXPECT_EQ(plain_text("a\x1b[2Jb\nc\x7f\t", 20), "a [2Jb c  ");
}

}  // namespace
}  // namespace handloft
