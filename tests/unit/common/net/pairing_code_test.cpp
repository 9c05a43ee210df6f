// Codes for pairing: what is written is read again, and every slip of the tongue or the hand is found (U2).

#include "common/net/pairing_code.h"

#include <gtest/gtest.h>

namespace handloft::net {
namespace {

const PairingCode example{"0123456789abcdeffedcba9876543210", 0x0FEDCBA987654321ULL};

TEST(PairingCode, HasFortySignsInGroupsOfFive) {
  const std::string text = write_pairing_code(example);
  EXPECT_EQ(text.size(), 47U);
  for (std::size_t i = 0; i < text.size(); ++i) EXPECT_EQ(text[i] == '-', i % 6 == 5) << i;
  EXPECT_EQ(text.find_first_of("ILOU"), std::string::npos);
  // Reckoned apart, by hand of another program.
  EXPECT_EQ(text, "014D2-PF2DB-SQQZX-Q5TK1-V58CG-GZVEB-N63PA-GS1P1");
}

TEST(PairingCode, IsReadAgainHoweverItWasWritten) {
  const std::string text = write_pairing_code(example);
  EXPECT_EQ(*read_pairing_code(text), example);
  std::string said;
  for (const char c : text) {
    said += c == '0' ? 'o' : c == '1' ? 'l' : c == '-' ? ' ' : static_cast<char>(std::tolower(c));
  }
  EXPECT_EQ(*read_pairing_code("  " + said + "\n"), example);
  for (const std::uint64_t secret : {std::uint64_t{0}, std::uint64_t{1}, pairing_secrets - 1}) {
    const PairingCode code{std::string(32, 'f'), secret};
    EXPECT_EQ(*read_pairing_code(write_pairing_code(code)), code);
  }
}

TEST(PairingCode, EveryWrongSignIsFound) {
  const std::string text = write_pairing_code(example);
  for (std::size_t place = 0; place < text.size(); ++place) {
    if (text[place] == '-') continue;
    for (const char sign : std::string_view("0123456789ABCDEFGHJKMNPQRSTVWXYZ")) {
      if (sign == text[place]) continue;
      std::string wrong = text;
      wrong[place] = sign;
      const auto read = read_pairing_code(wrong);
      ASSERT_FALSE(read.ok()) << wrong;
      EXPECT_EQ(read.error().code, ErrorCode::invalid_argument);
    }
  }
}

TEST(PairingCode, EveryTwoSwappedSignsAreFound) {
  std::string signs;
  for (const char c : write_pairing_code(example)) {
    if (c != '-') signs += c;
  }
  for (std::size_t place = 0; place + 1 < signs.size(); ++place) {
    if (signs[place] == signs[place + 1]) continue;
    std::string wrong = signs;
    std::swap(wrong[place], wrong[place + 1]);
    EXPECT_FALSE(read_pairing_code(wrong).ok()) << place;
  }
}

TEST(PairingCode, OtherTextsAreRefusedInWords) {
  EXPECT_FALSE(read_pairing_code("").ok());
  EXPECT_FALSE(read_pairing_code("hello").ok());
  EXPECT_FALSE(read_pairing_code(std::string(1'000'000, '0')).ok());
  EXPECT_FALSE(read_pairing_code(write_pairing_code(example) + "0").ok());
  EXPECT_FALSE(read_pairing_code(std::string(40, 'U')).ok());
}

}  // namespace
}  // namespace handloft::net
