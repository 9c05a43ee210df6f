// Bombs in a serialised message are counted before anything is built of them (F2).

#include "common/net/message_parts.h"

#include <gtest/gtest.h>

#include <string>

#include "proto/session.pb.h"

namespace handloft::net {
namespace {

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

v1::Envelope scene(int entities, int curves) {
  v1::Envelope envelope;
  for (int i = 0; i < entities; ++i) {
    v1::EntityState& entity = *envelope.mutable_snapshot()->add_entities();
    for (int k = 0; k < curves; ++k) entity.add_curves();
  }
  return envelope;
}

TEST(MessageParts, AreMessagesAndTextsAtEveryDepth) {
  // The snapshot itself, 3 entities, 2 curves each.
  EXPECT_EQ(*count_message_parts(bytes_of(scene(3, 2).SerializeAsString()), 1000), 10U);
  v1::Envelope named = scene(1, 0);
  named.mutable_snapshot()->mutable_entities(0)->set_id("a");
  named.mutable_snapshot()->mutable_entities(0)->set_revision(3);
  EXPECT_EQ(*count_message_parts(bytes_of(named.SerializeAsString()), 1000), 3U) << "a number is no part";
  EXPECT_EQ(*count_message_parts({}, 1000), 0U);
}

TEST(MessageParts, ABombOfEmptyEntitiesIsRefusedByItsField) {
  const std::string bomb = scene(50'000, 0).SerializeAsString();
  EXPECT_LT(bomb.size(), 110'000U) << "two bytes each";
  const Result<std::size_t> refused = count_message_parts(bytes_of(bomb), 10'000);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::resource_exhausted);
  EXPECT_EQ(refused.error().field, "SceneSnapshot");
  EXPECT_TRUE(count_message_parts(bytes_of(bomb), 50'001).ok()) << "the limit itself is allowed";
}

TEST(MessageParts, UnknownFieldsCountToo) {
  std::string unknown;
  for (int i = 0; i < 100; ++i) unknown += std::string("\xF8\x06\x01", 3);  // Field 111, a number.
  EXPECT_EQ(*count_message_parts(bytes_of(unknown), 1000), 100U);
}

TEST(MessageParts, CutBytesAreCorruptNeverReadBeyond) {
  const std::string whole = scene(2, 2).SerializeAsString();
  int refused = 0;
  for (std::size_t length = 1; length < whole.size(); ++length) {
    const std::string cut = whole.substr(0, length);
    refused += count_message_parts(bytes_of(cut), 1000).ok() ? 0 : 1;
    v1::Envelope parsed;
    EXPECT_EQ(count_message_parts(bytes_of(cut), 1000).ok(), parsed.ParseFromString(cut))
        << "as the parser sees it, at " << length;
  }
  EXPECT_EQ(refused, static_cast<int>(whole.size()) - 1) << "the outermost field is always cut";
  EXPECT_FALSE(count_message_parts(bytes_of(std::string(20, '\xFF')), 1000).ok())
      << "a number without an end";
}

}  // namespace
}  // namespace handloft::net
