// The recording file: append-only, checksummed, readable after a crash (T13; D4, D5 of reliability.md).

#include "common/record/recording.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/test_data.h"

namespace handloft::record {
namespace {

using testing::HasSubstr;
using Bytes = std::vector<std::uint8_t>;

Metadata metadata() {
  Metadata data;
  data.program = "handloft-test 0.1.0";
  data.started_at = "2026-01-31T12:00:00.000Z";
  data.started_at_ns = 123;
  data.more = {{"rig", "default"}};
  return data;
}

Bytes contents(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return Bytes(std::istreambuf_iterator<char>(file), {});
}

Bytes payload_of(int i) {
  return Bytes(static_cast<std::size_t>(i * 7 + 1), static_cast<std::uint8_t>(i));
}

// A recording of `count` records, as bytes.
Bytes recorded(int count) {
  const test::TemporaryDirectory folder;
  const ManualClock clock;
  auto writer = RecordingWriter::create(folder.path() / "a.rec", metadata(), clock);
  EXPECT_TRUE(writer.ok());
  for (int i = 0; i < count; ++i) {
    EXPECT_TRUE(writer->append(static_cast<std::uint16_t>(i + 1), from_ns(1000 + i), payload_of(i)).ok());
  }
  EXPECT_TRUE(writer->finish().ok());
  return contents(folder.path() / "a.rec");
}

struct Read {
  int records = 0;
  std::optional<Error> error;
  RecordingEnd end = RecordingEnd::complete;
};

// Reads what there is and checks that whole records are what was written.
Read read_all(const Bytes& bytes) {
  Read result;
  auto reader = RecordingReader::from_bytes(bytes, "test.rec");
  if (!reader) {
    result.error = reader.error();
    return result;
  }
  for (;;) {
    const auto record = reader->next();
    if (!record) {
      result.error = record.error();
      return result;
    }
    if (!*record) break;
    EXPECT_EQ((*record)->type, result.records + 1);
    EXPECT_EQ(to_ns((*record)->time), 1000 + result.records);
    EXPECT_TRUE(std::ranges::equal((*record)->payload, payload_of(result.records)));
    ++result.records;
  }
  result.end = reader->end();
  return result;
}

TEST(Recording, WhatWasWrittenIsRead) {
  const test::TemporaryDirectory folder;
  const auto path = folder.path() / "a.rec";
  const SystemClock clock;
  auto writer = RecordingWriter::create(path, metadata(), clock);
  ASSERT_TRUE(writer.ok()) << writer.error().describe();
  ASSERT_TRUE(writer->append(7, from_ns(-5), Bytes{1, 2, 3}).ok());
  ASSERT_TRUE(writer->append(65535, from_ns(9), {}).ok());
  EXPECT_EQ(writer->record_count(), 2u);
  ASSERT_TRUE(writer->finish().ok());
  EXPECT_FALSE(writer->append(1, from_ns(0), {}).ok()) << "after the end";

  auto reader = RecordingReader::open(path);
  ASSERT_TRUE(reader.ok()) << reader.error().describe();
  EXPECT_EQ(reader->metadata().program, "handloft-test 0.1.0");
  EXPECT_EQ(reader->metadata().started_at_ns, 123);
  EXPECT_EQ(reader->metadata().more.at("rig"), "default");
  auto first = reader->next();
  ASSERT_TRUE(first.ok() && first->has_value());
  EXPECT_EQ((*first)->type, 7);
  EXPECT_EQ(to_ns((*first)->time), -5);
  EXPECT_TRUE(std::ranges::equal((*first)->payload, Bytes{1, 2, 3}));
  auto second = reader->next();
  ASSERT_TRUE(second.ok() && second->has_value());
  EXPECT_EQ((*second)->payload.size(), 0u);
  EXPECT_FALSE(reader->next()->has_value());
  EXPECT_EQ(reader->end(), RecordingEnd::complete);
}

TEST(Recording, CutAtEveryByteOfTheLastRecordItIsReportedAndLeftOut) {
  const Bytes whole = recorded(4);
  const std::size_t without_last = recorded(3).size();
  for (std::size_t size = without_last + 1; size < whole.size(); ++size) {
    const Read read = read_all(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)));
    EXPECT_FALSE(read.error.has_value());
    EXPECT_EQ(read.records, 3);
    EXPECT_EQ(read.end, RecordingEnd::truncated);
  }
  EXPECT_EQ(read_all(whole).end, RecordingEnd::complete);
  EXPECT_EQ(read_all(recorded(3)).end, RecordingEnd::complete);
}

TEST(Recording, EveryFlippedBitIsFound) {
  const Bytes whole = recorded(3);
  const std::size_t head = recorded(0).size();
  for (std::size_t byte = 0; byte < whole.size(); ++byte) {
    for (int bit = 0; bit < 8; ++bit) {
      Bytes damaged = whole;
      damaged[byte] = static_cast<std::uint8_t>(damaged[byte] ^ (1u << bit));
      const Read read = read_all(damaged);
      ASSERT_TRUE(read.error.has_value()) << "byte " << byte << " bit " << bit;
      if (byte >= head) {
        EXPECT_EQ(read.error->code, ErrorCode::data_corrupt);
        EXPECT_THAT(read.error->describe(), HasSubstr("test.rec"));
      }
    }
  }
}

TEST(Recording, TheDamagedRecordIsNamedByItsOffset) {
  Bytes damaged = recorded(3);
  const std::size_t second = recorded(1).size();
  damaged[second + 24] ^= 1;  // the first payload byte of the second record
  const Read read = read_all(damaged);
  EXPECT_EQ(read.records, 1);
  EXPECT_THAT(read.error->message, HasSubstr("at byte " + std::to_string(second) + ":"));
}

TEST(Recording, OtherFilesAndVersionsAreRefused) {
  EXPECT_EQ(read_all({}).error->code, ErrorCode::data_corrupt);
  EXPECT_EQ(read_all(Bytes(100, 'x')).error->code, ErrorCode::data_corrupt);
  Bytes newer = recorded(1);
  newer[5] = 2;
  EXPECT_EQ(read_all(newer).error->code, ErrorCode::unsupported);
  EXPECT_EQ(RecordingReader::open("/does/not/exist").error().code, ErrorCode::not_found);
}

TEST(Recording, AFullDiskIsAnErrorThatStaysD5) {
  const ManualClock clock;
  auto writer = RecordingWriter::create("/dev/full", metadata(), clock);
  ASSERT_FALSE(writer.ok());
  EXPECT_EQ(writer.error().code, ErrorCode::io);
  EXPECT_THAT(writer.error().describe(), HasSubstr("/dev/full"));
}

TEST(Recording, TooLargeARecordIsRefusedAndTheNextIsTaken) {
  const test::TemporaryDirectory folder;
  const ManualClock clock;
  auto writer = RecordingWriter::create(folder.path() / "a.rec", metadata(), clock);
  EXPECT_EQ(writer->append(1, from_ns(0), Bytes(max_record_bytes + 1)).error().code,
            ErrorCode::resource_exhausted);
  EXPECT_TRUE(writer->append(1, from_ns(0), Bytes{1}).ok());
}

TEST(Recording, WhatIsOlderThanTheIntervalIsInTheFileBeforeTheEnd) {
  const test::TemporaryDirectory folder;
  const auto path = folder.path() / "a.rec";
  ManualClock clock;
  auto writer =
      RecordingWriter::create(path, metadata(), clock, {.flush_interval = std::chrono::milliseconds(200)});
  const std::size_t head = contents(path).size();
  ASSERT_TRUE(writer->append(1, from_ns(0), Bytes{1}).ok());
  EXPECT_EQ(contents(path).size(), head);
  clock.advance(std::chrono::milliseconds(200));
  ASSERT_TRUE(writer->append(2, from_ns(1), Bytes{2}).ok());
  const Bytes now = contents(path);
  EXPECT_GT(now.size(), head);
  auto reader = RecordingReader::from_bytes(now, "x");
  EXPECT_TRUE(reader->next()->has_value());
  EXPECT_TRUE(reader->next()->has_value());
}

}  // namespace
}  // namespace handloft::record
