// T9: the glove's report.

#include "daemon-tracking/source/glove_report.h"

#include <gtest/gtest.h>

#include <map>
#include <string>
#include <utility>
#include <vector>

namespace handloft::tracking {
namespace {

GloveReport example() {
  GloveReport report;
  report.flags = glove_charging;
  report.sequence = 0xABCD;
  report.device_time_us = 0x01020304;
  report.force = 1000;
  report.potentiometer = 17;
  report.contacts = contact_index | contact_table;
  report.battery_percent = 55;
  return report;
}

TEST(GloveReportT9, EncodesTheDocumentedLayout) {
  const auto bytes = encode_glove_report(example());
  const std::vector<std::uint8_t> head(bytes.begin(), bytes.begin() + 17);
  EXPECT_EQ(head,
            (std::vector<std::uint8_t>{1, 1, 1, 0, 0xCD, 0xAB, 4, 3, 2, 1, 0xE8, 3, 17, 0, 0x21, 0, 55}));
  for (std::size_t i = 17; i < 60; ++i) EXPECT_EQ(bytes[i], 0) << i;
}

TEST(GloveReportT9, ChecksumIsTheCommonCrc32) {
  // zlib's crc32 of the first 60 bytes of a report with all fields zero but id 1, version 1, battery 100;
  // computed with Python: zlib.crc32(bytes([1, 1] + [0] * 14 + [100] + [0] * 43)).
  const auto bytes = encode_glove_report(GloveReport{});
  const std::uint32_t found =
      static_cast<std::uint32_t>(bytes[60]) | static_cast<std::uint32_t>(bytes[61]) << 8 |
      static_cast<std::uint32_t>(bytes[62]) << 16 | static_cast<std::uint32_t>(bytes[63]) << 24;
  EXPECT_EQ(found, 0xc0ddc377u);
}

TEST(GloveReportT9, ParsesWhatItEncodes) {
  const auto parsed = parse_glove_report(encode_glove_report(example()));
  ASSERT_TRUE(parsed.ok()) << parsed.error().describe();
  EXPECT_EQ(*parsed, example());
}

TEST(GloveReportT9, RefusesEveryOtherLength) {
  const auto bytes = encode_glove_report(example());
  std::vector<std::uint8_t> longer(bytes.begin(), bytes.end());
  longer.push_back(0);
  for (std::size_t length = 0; length <= longer.size(); ++length) {
    const auto parsed = parse_glove_report(std::span(longer).first(length));
    if (length == glove_report_size) {
      EXPECT_TRUE(parsed.ok());
      continue;
    }
    ASSERT_FALSE(parsed.ok()) << length;
    EXPECT_EQ(parsed.error().code, ErrorCode::data_corrupt);
    EXPECT_EQ(parsed.error().field, "length");
  }
}

TEST(GloveReportT9, DetectsEverySingleBitError) {
  const auto good = encode_glove_report(example());
  for (std::size_t bit = 0; bit < 8 * glove_report_size; ++bit) {
    auto bad = good;
    bad[bit / 8] = static_cast<std::uint8_t>(bad[bit / 8] ^ (1u << (bit % 8)));
    EXPECT_FALSE(parse_glove_report(bad).ok()) << "bit " << bit;
  }
}

struct BadField {
  const char* field;
  void (*spoil)(GloveReport&);
};

class GloveReportRange : public testing::TestWithParam<BadField> {};

TEST_P(GloveReportRange, NamesTheFieldT9) {
  GloveReport report = example();
  GetParam().spoil(report);
  const auto parsed = parse_glove_report(encode_glove_report(report));
  ASSERT_FALSE(parsed.ok());
  EXPECT_EQ(parsed.error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(parsed.error().field, GetParam().field);
}

INSTANTIATE_TEST_SUITE_P(
    Fields, GloveReportRange,
    testing::Values(BadField{"force", [](GloveReport& r) { r.force = 1024; }},
                    BadField{"force", [](GloveReport& r) { r.force = 0xFFFF; }},
                    BadField{"potentiometer", [](GloveReport& r) { r.potentiometer = 1024; }},
                    BadField{"contacts", [](GloveReport& r) { r.contacts = 1u << 6; }},
                    BadField{"flags", [](GloveReport& r) { r.flags = 1u << 2; }},
                    BadField{"battery", [](GloveReport& r) { r.battery_percent = 101; }}));

TEST(GloveReportT9, LimitsThemselvesAreGood) {
  GloveReport report;
  report.force = report.potentiometer = glove_analogue_max;
  report.contacts = contact_all;
  report.flags = glove_flags_all;
  report.sequence = 0xFFFF;
  report.device_time_us = 0xFFFFFFFF;
  report.battery_percent = 0;
  const auto parsed = parse_glove_report(encode_glove_report(report));
  ASSERT_TRUE(parsed.ok()) << parsed.error().describe();
  EXPECT_EQ(*parsed, report);
}

TEST(GloveReportT9, DescriptorDescribesTheReports) {
  // Walks the descriptor's short items: which fields of 8 bits stand under which report id.
  const auto descriptor = glove_report_descriptor();
  unsigned size = 0, count = 0, id = 0, page = 0;
  std::map<unsigned, std::pair<unsigned, unsigned>> bits_by_item;  // item -> (id, bits)
  int depth = 0;
  std::size_t at = 0;
  while (at < descriptor.size()) {
    const unsigned prefix = descriptor[at++];
    const std::size_t length = (prefix & 3u) == 3u ? 4 : prefix & 3u;
    ASSERT_LE(at + length, descriptor.size());
    unsigned value = 0;
    for (std::size_t i = 0; i < length; ++i) value |= static_cast<unsigned>(descriptor[at + i]) << (8 * i);
    at += length;
    switch (prefix & 0xFCu) {
      case 0x04:
        page = value;
        break;
      case 0x74:
        size = value;
        break;
      case 0x94:
        count = value;
        break;
      case 0x84:
        id = value;
        break;
      case 0x80:
      case 0x90:
      case 0xB0:
        EXPECT_TRUE(bits_by_item.emplace(prefix & 0xFCu, std::pair(id, size * count)).second);
        break;
      case 0xA0:
        ++depth;
        break;
      case 0xC0:
        --depth;
        break;
      default:
        break;
    }
  }
  EXPECT_EQ(page, glove_usage_page);
  EXPECT_EQ(depth, 0);
  EXPECT_EQ(bits_by_item[0x80], std::pair(1u, 8u * 63u));
  EXPECT_EQ(bits_by_item[0x90], std::pair(2u, 8u * 7u));
  EXPECT_EQ(bits_by_item[0xB0], std::pair(3u, 8u * 15u));
}

TEST(GloveReportT9, RangeAndOutputRoundTripAndAreChecked) {
  const GloveRange range{31, 900, 12, 1001, true};
  auto bytes = encode_glove_range(range);
  const auto parsed = parse_glove_range(bytes);
  ASSERT_TRUE(parsed.ok()) << parsed.error().describe();
  EXPECT_EQ(*parsed, range);
  bytes[2] ^= 1;
  EXPECT_EQ(parse_glove_range(bytes).error().field, "checksum");
  EXPECT_EQ(parse_glove_range(encode_glove_range({500, 500, 0, 1023, true})).error().field, "force");
  EXPECT_EQ(parse_glove_range(encode_glove_range({0, 1023, 5, 1024, true})).error().field, "potentiometer");
  EXPECT_EQ(parse_glove_range(std::span(bytes).first(15)).error().field, "length");

  const GloveOutput output{255, 128, 1, 200, 1000};
  const auto shown = parse_glove_output(encode_glove_output(output));
  ASSERT_TRUE(shown.ok()) << shown.error().describe();
  EXPECT_EQ(*shown, output);
  EXPECT_EQ(parse_glove_output(encode_glove_output({0, 0, 0, 1, 1001})).error().field, "vibration_ms");
}

}  // namespace
}  // namespace handloft::tracking
