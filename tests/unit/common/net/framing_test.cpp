// PROTOCOL.md, "Framing": a little-endian u32 and as many bytes.

#include "common/net/framing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/session.pb.h"

namespace handloft::net {
namespace {

using testing::ElementsAre;
using Bytes = std::vector<std::uint8_t>;

v1::Envelope ping(std::uint64_t id) {
  v1::Envelope envelope;
  envelope.mutable_ping()->set_id(id);
  return envelope;
}

TEST(Framing, HandValueOfAPing) {
  const auto frame = encode_frame(ping(5));
  ASSERT_TRUE(frame.ok());
  const Bytes bytes((*frame)->begin(), (*frame)->end());
  // Envelope field 4 (ping), length 2: field 1 (id) = 5.
  EXPECT_THAT(bytes, ElementsAre(4, 0, 0, 0, 0x22, 0x02, 0x08, 0x05));
}

TEST(Framing, AMessageAboveTheLimitIsNotEncoded) {
  v1::Envelope envelope;
  envelope.mutable_failure()->set_message(std::string(100, 'x'));
  EXPECT_EQ(encode_frame(envelope, 50).error().code, ErrorCode::resource_exhausted);
}

TEST(FrameDecoder, FindsFramesInSinglyArrivingBytes) {
  FrameDecoder decoder;
  const std::string stream = **encode_frame(ping(1)) + **encode_frame(ping(300));
  std::vector<std::uint64_t> ids;
  for (const char byte : stream) {
    const auto value = static_cast<std::uint8_t>(byte);
    decoder.append({&value, 1});
    const auto payload = decoder.next();
    ASSERT_TRUE(payload.ok());
    if (!*payload) continue;
    v1::Envelope envelope;
    ASSERT_TRUE(parse_envelope(**payload, envelope).ok());
    ids.push_back(envelope.ping().id());
  }
  EXPECT_THAT(ids, ElementsAre(1, 300));
  EXPECT_FALSE(decoder.mid_frame());
}

TEST(FrameDecoder, TheLimitItselfIsAllowedOneMoreIsNot) {
  FrameDecoder decoder(8);
  decoder.append(Bytes{8, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 0, 0, 0});
  ASSERT_TRUE(decoder.next()->has_value());
  const auto error = decoder.next();
  ASSERT_FALSE(error.ok());
  EXPECT_EQ(error.error().code, ErrorCode::resource_exhausted);
  EXPECT_FALSE(decoder.next().ok()) << "stays in error";
}

TEST(FrameDecoder, AnAnnouncementAllocatesNothing) {
  FrameDecoder decoder(default_max_frame_bytes);
  decoder.append(Bytes{0, 0, 0, 1});  // 16 MiB
  ASSERT_FALSE(decoder.next()->has_value());
  EXPECT_LE(decoder.capacity(), 128u << 10);
}

TEST(FrameDecoder, ALargeFramesMemoryIsGivenBack) {
  FrameDecoder decoder;
  Bytes large(frame_header_bytes + (4u << 20));
  large[2] = 0x40;  // 4 MiB
  decoder.append(large);
  ASSERT_TRUE(decoder.next()->has_value());
  EXPECT_LE(decoder.capacity(), 8u << 20);
  decoder.append(Bytes{1});
  EXPECT_LE(decoder.capacity(), 128u << 10);
}

TEST(FrameDecoder, AnEmptyFrameIsAFrameButNoMessage) {
  FrameDecoder decoder;
  decoder.append(Bytes{0, 0, 0, 0});
  const auto payload = decoder.next();
  ASSERT_TRUE(payload->has_value());
  v1::Envelope envelope;
  EXPECT_EQ(parse_envelope(**payload, envelope).error().code, ErrorCode::unsupported);
}

TEST(Framing, UnknownAndMalformedMessagesAreToldApart) {
  v1::Envelope envelope;
  const Bytes unknown{0xA2, 0x06, 0x00};  // field 100, no bytes
  EXPECT_EQ(parse_envelope(unknown, envelope).error().code, ErrorCode::unsupported);
  const Bytes malformed{0x22, 0x7F, 0x08};  // promises 127 bytes
  EXPECT_EQ(parse_envelope(malformed, envelope).error().code, ErrorCode::data_corrupt);
}

TEST(Framing, TextThatIsNoUtf8IsRefusedQuietly) {
  v1::Envelope envelope;
  const Bytes bad_text{0x0A, 0x04, 0x22, 0x02, 0xFF, 0xFE};  // hello.program
  testing::internal::CaptureStderr();
  EXPECT_EQ(parse_envelope(bad_text, envelope).error().code, ErrorCode::data_corrupt);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

}  // namespace
}  // namespace handloft::net
