// T1, T9, T13: the parsers of serial gloves, 3D mice, pens and report descriptors, on good and on hostile
// bytes.

#include <gtest/gtest.h>

#include <string>

#include "daemon-tracking/source/glove/serial_glove_line.h"
#include "daemon-tracking/source/glove_report.h"
#include "daemon-tracking/source/hid/report_descriptor.h"
#include "daemon-tracking/source/pen/pen_events.h"
#include "daemon-tracking/source/pen/pen_streams.h"
#include "daemon-tracking/source/sample_codec.h"
#include "daemon-tracking/source/space_mouse/space_mouse_report.h"

namespace handloft::tracking {
namespace {

Result<SerialGloveLine> parse(const std::string& text) {
  return parse_serial_glove_line({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

TEST(SerialGloveLine, ReadsAlphaEncoding) {
  const auto line = parse("A2047B1023C0D4095E12F2000G100HJL(AB)512(AAB)7P300\r");
  ASSERT_TRUE(line.ok()) << line.error().describe();
  EXPECT_EQ(line->curl[0], 2047);
  EXPECT_EQ(line->curl[1], 1023);
  EXPECT_EQ(line->curl[2], 0);
  EXPECT_EQ(line->curl[3], 4095);
  EXPECT_EQ(line->curl[4], 12);
  EXPECT_EQ(line->joystick_x, 2000);
  EXPECT_EQ(line->joystick_y, 100);
  EXPECT_EQ(line->trigger, 300);
  EXPECT_EQ(line->buttons, serial_joystick | serial_a | serial_grab);
  const auto few = parse("B5M");
  ASSERT_TRUE(few.ok());
  EXPECT_FALSE(few->curl[0].has_value());
  EXPECT_EQ(few->buttons, serial_pinch);
}

TEST(SerialGloveLine, WhatItWritesItReads) {
  SerialGloveLine line;
  line.curl = {1, 2, std::nullopt, 4, 4095};
  line.joystick_y = 77;
  line.trigger = 0;
  line.buttons = serial_b | serial_calibrate;
  const auto read = parse(encode_serial_glove_line(line));
  ASSERT_TRUE(read.ok()) << read.error().describe();
  EXPECT_EQ(*read, line);
}

TEST(SerialGloveLine, RefusesWhatIsNone) {
  for (const char* bad : {"",     "\r",       "A",    "A-1",     "A4096", "A99999999999999999999",
                          "A1A2", "Q5",       "a5",   "A 5",     "(",     "()5",
                          "(A)5", "(AB",      "(AB)", "(ABCD)5", "(A1)5", "HH",
                          "A5\n", "\xff\xfe", "J5",   "Z"}) {
    const auto line = parse(bad);
    EXPECT_FALSE(line.ok()) << bad;
  }
  EXPECT_EQ(parse("A5B").error().field, "B");
  EXPECT_EQ(parse("A4096").error().code, ErrorCode::invalid_argument);
  EXPECT_FALSE(parse(std::string(max_serial_glove_line + 1, 'H')).ok());
}

TEST(SerialGloveLine, EveryPrefixOfALineIsALineOrAnError) {
  const std::string whole = "A2047B1023C0D4095E12F2000G100HJL(AB)512(AAB)7P300";
  for (std::size_t size = 0; size <= whole.size(); ++size) {
    if (const auto line = parse(whole.substr(0, size))) {
      EXPECT_TRUE(parse(encode_serial_glove_line(*line)).ok() || *line == SerialGloveLine{});
    }
  }
}

TEST(LineCutter, CutsAcrossReadsOfEverySizeAndDropsEndlessLines) {
  const std::string stream = "rest of a line\nA1\n\n" + std::string(600, 'x') + "\nB2\nC3";
  for (std::size_t chunk = 1; chunk <= stream.size(); ++chunk) {
    LineCutter cutter;
    cutter.skip_to_next();
    std::vector<std::string> lines;
    for (std::size_t at = 0; at < stream.size(); at += chunk) {
      const std::string part = stream.substr(at, chunk);
      cutter.feed({reinterpret_cast<const std::uint8_t*>(part.data()), part.size()},
                  [&](std::span<const std::uint8_t> line) { lines.emplace_back(line.begin(), line.end()); });
    }
    ASSERT_EQ(lines, (std::vector<std::string>{"A1", "B2"})) << chunk;
    ASSERT_EQ(cutter.dropped(), 2u);
  }
}

TEST(SpaceMouseReport, ReadsEveryForm) {
  const std::uint8_t translation[] = {1, 0x5E, 0x01, 0xA2, 0xFE, 0x00, 0x80};
  auto report = parse_space_mouse_report(translation);
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(report->part, SpaceMousePart::translation);
  EXPECT_EQ(report->translation, (std::array<std::int16_t, 3>{350, -350, -32768}));
  const std::uint8_t both[] = {1, 1, 0, 2, 0, 3, 0, 4, 0, 5, 0, 6, 0};
  report = parse_space_mouse_report(both);
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(report->part, SpaceMousePart::both);
  EXPECT_EQ(report->rotation, (std::array<std::int16_t, 3>{4, 5, 6}));
  const std::uint8_t buttons[] = {3, 0x01, 0x80, 0, 0, 0xFF};
  report = parse_space_mouse_report(buttons);
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(report->buttons, 0x8001u);
  const std::uint8_t battery[] = {0x17, 90};
  EXPECT_EQ(parse_space_mouse_report(battery)->part, SpaceMousePart::other);
}

TEST(SpaceMouseReport, RefusesOtherLengths) {
  for (std::size_t size = 0; size <= 70; ++size) {
    std::vector<std::uint8_t> bytes(size, 0);
    for (const std::uint8_t id : std::initializer_list<std::uint8_t>{1, 2, 3}) {
      if (size > 0) bytes[0] = id;
      const bool good = id == 3 ? size >= 2 && size <= 9 : size == 7 || (id == 1 && size == 13);
      EXPECT_EQ(parse_space_mouse_report(bytes).ok(), good) << int{id} << " " << size;
    }
  }
  EXPECT_TRUE(is_known_space_mouse(0x046D, 0xC626));
  EXPECT_FALSE(is_known_space_mouse(0x256F, 0xC626)) << "the numbers belong together";
}

TEST(PenEvents, RoundTripAndRefuse) {
  const PenFacts facts = simulated_pen_facts();
  auto bytes = encode_pen_facts(facts);
  const auto read = parse_pen_facts(bytes);
  ASSERT_TRUE(read.ok()) << read.error().describe();
  EXPECT_EQ(*read, facts);
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_FALSE(parse_pen_facts(std::span(bytes).first(size)).ok());
  PenFacts bad = facts;
  bad.pressure = {true, 5, 5, 0};
  EXPECT_EQ(parse_pen_facts(encode_pen_facts(bad)).error().field, "pressure");
  bad = facts;
  bad.y.present = false;
  EXPECT_EQ(parse_pen_facts(encode_pen_facts(bad)).error().field, "y");
  bytes[0] = 2;
  EXPECT_EQ(parse_pen_facts(bytes).error().code, ErrorCode::unsupported);

  const std::vector<PenEvent> events{{from_ns(-5), 3, 0, -7},
                                     {from_ns(1'000'000'000'000), 0xFFFF, 1, 2'000'000'000}};
  const auto again = parse_pen_events(encode_pen_events(events));
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(*again, events);
  EXPECT_FALSE(parse_pen_events({}).ok());
  EXPECT_FALSE(parse_pen_events(std::vector<std::uint8_t>(17)).ok());
  EXPECT_FALSE(parse_pen_events(std::vector<std::uint8_t>(16 * 257)).ok());
}

TEST(ReportDescriptor, KnowsTheGloveFromOtherThings) {
  const auto reports = parse_report_descriptor(glove_report_descriptor());
  ASSERT_TRUE(reports.ok()) << reports.error().describe();
  EXPECT_TRUE(reports->is({glove_usage_page, glove_usage}));
  EXPECT_EQ(HidReports::bytes(reports->input_bits, glove_report_id), 63u);
  EXPECT_EQ(HidReports::bytes(reports->output_bits, glove_output_id), 7u);
  EXPECT_EQ(HidReports::bytes(reports->feature_bits, glove_range_id), 15u);
  EXPECT_EQ(HidReports::bytes(reports->input_bits, 9), 0u);
  // A keyboard's usual beginning.
  const std::uint8_t keyboard[] = {0x05, 0x01, 0x09, 0x06, 0xA1, 0x01, 0x75,
                                   0x01, 0x95, 0x08, 0x81, 0x02, 0xC0};
  const auto other = parse_report_descriptor(keyboard);
  ASSERT_TRUE(other.ok());
  EXPECT_TRUE(other->is({1, 6}));
  EXPECT_FALSE(other->is({glove_usage_page, glove_usage}));
}

TEST(ReportDescriptor, EveryTruncationOfAGoodOneIsAnError) {
  const auto whole = glove_report_descriptor();
  for (std::size_t size = 1; size < whole.size(); ++size) {
    const auto reports = parse_report_descriptor(whole.first(size));
    // Before the first collection opens nothing is missing yet.
    if (size >= 7) {
      EXPECT_FALSE(reports.ok()) << size;
    }
  }
  const std::uint8_t absurd[] = {0x77, 0xFF, 0xFF, 0xFF, 0xFF, 0x97, 0xFF, 0xFF, 0xFF, 0xFF, 0x81, 0x02};
  EXPECT_FALSE(parse_report_descriptor(absurd).ok());
  EXPECT_FALSE(parse_report_descriptor(std::vector<std::uint8_t>(5000)).ok());
  const std::uint8_t unbalanced[] = {0xC0};
  EXPECT_FALSE(parse_report_descriptor(unbalanced).ok());
}

TEST(SampleCodecT13, CarriesTheBytesOfEveryOtherDevice) {
  for (const DeviceData kind : {DeviceData::space_mouse_report, DeviceData::pen_facts, DeviceData::pen_events,
                                DeviceData::serial_glove_line}) {
    const Sample sample = DeviceBytes{from_ns(77), kind, {9, 8, 7}};
    const auto bytes = encode_sample(sample);
    ASSERT_TRUE(bytes.ok());
    const auto read = decode_sample(*bytes);
    ASSERT_TRUE(read.ok()) << read.error().describe();
    const auto& data = std::get<DeviceBytes>(*read);
    EXPECT_EQ(data.kind, kind);
    EXPECT_EQ(data.arrival_time, from_ns(77));
    EXPECT_EQ(data.bytes, (std::vector<std::uint8_t>{9, 8, 7}));
    for (std::size_t size = 0; size < bytes->size(); ++size)
      EXPECT_FALSE(decode_sample(std::span(*bytes).first(size)).ok());
  }
  EXPECT_FALSE(
      encode_sample(DeviceBytes{from_ns(0), DeviceData::pen_events, std::vector<std::uint8_t>(4097)}).ok());
  const auto odd = encode_sample(DeviceBytes{from_ns(0), static_cast<DeviceData>(5), {}});
  ASSERT_FALSE(odd.ok());
  EXPECT_EQ(odd.error().code, ErrorCode::unsupported);
}

}  // namespace
}  // namespace handloft::tracking
