// T13: samples to bytes and back, and through a recording.

#include "daemon-tracking/source/sample_codec.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "daemon-tracking/source/recorded/recorded_stream.h"
#include "tests/support/test_data.h"

namespace handloft::tracking {
namespace {

Sample frame_sample() {
  CameraFrame frame;
  frame.camera = 2;
  frame.sequence = 0x123456789AULL;
  frame.capture_time = from_ns(5'000'000'123);
  frame.arrival_time = from_ns(5'004'000'000);
  frame.width_px = 640;
  frame.height_px = 480;
  frame.bytes =
      std::make_shared<const std::vector<std::uint8_t>>(std::vector<std::uint8_t>{0xFF, 0xD8, 1, 2, 3});
  return frame;
}

Sample truth_sample() {
  Truth truth;
  truth.time = from_ns(-7);
  truth.hand_present = true;
  for (int i = 0; i < 15; ++i) truth.fingertips_m[i / 3][i % 3] = 0.1 * i + 1e-17;
  truth.head_position_m[1] = -0.36;
  truth.pressure = 0.625;
  return truth;
}

std::vector<Sample> examples() {
  return {frame_sample(), GloveBytes{from_ns(42), {1, 2, 3}},
          DevicePresence{from_ns(43), "camera/left", true}, truth_sample()};
}

std::vector<std::uint8_t> encoded(const Sample& sample) {
  auto bytes = encode_sample(sample);
  EXPECT_TRUE(bytes.ok());
  return bytes.ok() ? std::move(*bytes) : std::vector<std::uint8_t>{};
}

TEST(SampleCodecT13, RoundTripsToTheBit) {
  for (const Sample& sample : examples()) {
    const auto bytes = encoded(sample);
    const auto decoded = decode_sample(bytes);
    ASSERT_TRUE(decoded.ok()) << decoded.error().describe();
    EXPECT_EQ(decoded->index(), sample.index());
    EXPECT_EQ(encoded(*decoded), bytes);
    EXPECT_EQ(delivery_time(*decoded), delivery_time(sample));
  }
}

TEST(SampleCodecT13, KeepsAFramesFields) {
  const auto decoded = decode_sample(encoded(frame_sample()));
  ASSERT_TRUE(decoded.ok());
  const auto& frame = std::get<CameraFrame>(*decoded);
  const CameraFrame expected = std::get<CameraFrame>(frame_sample());
  EXPECT_EQ(frame.camera, expected.camera);
  EXPECT_EQ(frame.sequence, expected.sequence);
  EXPECT_EQ(frame.capture_time, expected.capture_time);
  EXPECT_EQ(frame.format, PixelFormat::mjpeg);
  EXPECT_EQ(frame.width_px, 640);
  EXPECT_EQ(frame.height_px, 480);
  EXPECT_EQ(*frame.bytes, *expected.bytes);
}

TEST(SampleCodecT13, RefusesEveryTruncationAndTrailingBytes) {
  for (const Sample& sample : examples()) {
    auto bytes = encoded(sample);
    for (std::size_t length = 0; length < bytes.size(); ++length) {
      const auto decoded = decode_sample(std::span(bytes).first(length));
      ASSERT_FALSE(decoded.ok()) << "kind " << int{bytes[0]} << " length " << length;
      EXPECT_EQ(decoded.error().code, ErrorCode::data_corrupt);
    }
    bytes.push_back(0);
    EXPECT_FALSE(decode_sample(bytes).ok());
  }
}

TEST(SampleCodecT13, RefusesALengthBeyondTheBytes) {
  auto bytes = encoded(frame_sample());
  constexpr std::size_t length_at = 1 + 4 + 8 + 8 + 8 + 1 + 2 + 2;
  for (std::size_t i = 0; i < 4; ++i) bytes[length_at + i] = 0xFF;
  const auto decoded = decode_sample(bytes);
  ASSERT_FALSE(decoded.ok());
  EXPECT_EQ(decoded.error().field, "bytes");
}

TEST(SampleCodecT13, RefusesWhatDoesNotFit) {
  EXPECT_FALSE(encode_sample(GloveBytes{from_ns(0), std::vector<std::uint8_t>(65)}).ok());
  EXPECT_FALSE(encode_sample(DevicePresence{from_ns(0), std::string(256, 'x'), true}).ok());
  Truth truth;
  truth.pressure = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(encode_sample(truth).ok());
  CameraFrame frame;  // No size.
  EXPECT_FALSE(encode_sample(frame).ok());
  const std::vector<std::uint8_t> unknown{9, 0, 0};
  const auto decoded = decode_sample(unknown);
  ASSERT_FALSE(decoded.ok());
  EXPECT_EQ(decoded.error().code, ErrorCode::unsupported);
}

TEST(RecordedStreamT13, ReplaysWhatWasRecorded) {
  const test::TemporaryDirectory folder;
  const auto path = folder.path() / "session.rec";
  {
    const SystemClock clock;
    auto writer = record::RecordingWriter::create(path, {}, clock);
    ASSERT_TRUE(writer.ok()) << writer.error().describe();
    for (const Sample& sample : examples()) ASSERT_TRUE(append_sample(*writer, sample).ok());
    const std::vector<std::uint8_t> other{1, 2, 3};
    ASSERT_TRUE(writer->append(sample_record_type + 1, from_ns(50), other).ok());
    ASSERT_TRUE(writer->finish().ok());
  }
  auto all = RecordedStream::open(path);
  ASSERT_TRUE(all.ok()) << all.error().describe();
  for (const Sample& sample : examples()) {
    const auto replayed = (*all)->next();
    ASSERT_TRUE(replayed.has_value());
    EXPECT_EQ(encoded(*replayed), encoded(sample));
  }
  EXPECT_FALSE((*all)->next().has_value());
  EXPECT_FALSE((*all)->error().has_value());

  auto camera = RecordedStream::open(path, {RecordedSelection::Kind::camera, 2, "camera/left"});
  ASSERT_TRUE(camera.ok());
  EXPECT_TRUE(std::holds_alternative<CameraFrame>(*(*camera)->next()));
  EXPECT_TRUE(std::holds_alternative<DevicePresence>(*(*camera)->next()));
  EXPECT_FALSE((*camera)->next().has_value());

  auto glove = RecordedStream::open(path, {RecordedSelection::Kind::glove, 0, "glove"});
  ASSERT_TRUE(glove.ok());
  EXPECT_TRUE(std::holds_alternative<GloveBytes>(*(*glove)->next()));
  EXPECT_FALSE((*glove)->next().has_value());

  const auto shift = shift_to(path, from_ns(10'000'000'000));
  ASSERT_TRUE(shift.ok());
  EXPECT_EQ(shift->count(), 10'000'000'000 - 5'004'000'000);
}

TEST(RecordedStreamT13, MissingFileIsAnError) {
  EXPECT_FALSE(RecordedStream::open("/nonexistent/session.rec").ok());
}

}  // namespace
}  // namespace handloft::tracking
