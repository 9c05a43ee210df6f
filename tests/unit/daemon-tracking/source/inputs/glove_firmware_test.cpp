// T9: the glove's firmware, as far as it needs no glove: what it sends is what the daemon reads.

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "daemon-tracking/source/glove_report.h"
#include "daemon-tracking/source/hid/report_descriptor.h"
#include "deploy/firmware/glove/glove_descriptors.h"
#include "deploy/firmware/glove/glove_logic.h"

namespace handloft::tracking {
namespace {

TEST(GloveFirmwareT9, ItsReportsAreWhatTheDaemonReads) {
  glove_state state{};
  std::array<std::uint8_t, GLOVE_REPORT_SIZE> bytes{};
  std::uint32_t random = 1;
  for (int i = 0; i < 2000; ++i) {
    random = random * 1664525u + 1013904223u;
    state.flags = static_cast<std::uint16_t>(i % 2 == 0 ? GLOVE_FLAG_RESTARTED : 0);
    state.sequence = static_cast<std::uint16_t>(random);
    state.time_us = random ^ 0x5A5A5A5Au;
    state.force = static_cast<std::uint16_t>(random >> 22);
    state.potentiometer = static_cast<std::uint16_t>(random >> 12 & 1023u);
    state.contacts = static_cast<std::uint16_t>(random >> 5 & contact_all);
    state.battery_percent = static_cast<std::uint8_t>(i % 101);
    glove_pack(&state, bytes.data());
    const auto report = parse_glove_report(bytes);
    ASSERT_TRUE(report.ok()) << report.error().describe();
    EXPECT_EQ(report->flags, state.flags);
    EXPECT_EQ(report->sequence, state.sequence);
    EXPECT_EQ(report->device_time_us, state.time_us);
    EXPECT_EQ(report->force, state.force);
    EXPECT_EQ(report->potentiometer, state.potentiometer);
    EXPECT_EQ(report->contacts, state.contacts);
    EXPECT_EQ(report->battery_percent, state.battery_percent);
  }
}

TEST(GloveFirmwareT9, ItsChecksumIsThatOfTheStandard) {
  // The check value of CRC-32/ISO-HDLC.
  const std::uint8_t digits[] = {'1', '2', '3', '4', '5', '6', '7', '8', '9'};
  EXPECT_EQ(glove_crc32(digits, 9), 0xCBF43926u);
}

TEST(GloveFirmwareT9, ItsDescriptorsAreThoseThatTheDaemonLooksFor) {
  const auto expected = glove_report_descriptor();
  const std::vector<std::uint8_t> found(glove_hid_report_descriptor,
                                        glove_hid_report_descriptor + GLOVE_REPORT_DESCRIPTOR_SIZE);
  EXPECT_EQ(found, std::vector<std::uint8_t>(expected.begin(), expected.end()));
  EXPECT_EQ(glove_device_descriptor[8] | glove_device_descriptor[9] << 8, glove_usb_vendor);
  EXPECT_EQ(glove_device_descriptor[10] | glove_device_descriptor[11] << 8, glove_usb_product);
  // Walks the configuration: its lengths add up, and the HID descriptor tells the report descriptor's.
  int at = 0, interfaces = 0, endpoints = 0;
  while (at < GLOVE_CONFIGURATION_SIZE) {
    const std::uint8_t length = glove_configuration[at], kind = glove_configuration[at + 1];
    ASSERT_GE(length, 2);
    interfaces += kind == 4 ? 1 : 0;
    endpoints += kind == 5 ? 1 : 0;
    if (kind == 0x21) {
      EXPECT_EQ(at, GLOVE_HID_DESCRIPTOR_AT);
      EXPECT_EQ(glove_configuration[at + 7] | glove_configuration[at + 8] << 8, GLOVE_REPORT_DESCRIPTOR_SIZE);
    }
    at += length;
  }
  EXPECT_EQ(at, GLOVE_CONFIGURATION_SIZE);
  EXPECT_EQ(glove_configuration[2] | glove_configuration[3] << 8, GLOVE_CONFIGURATION_SIZE);
  EXPECT_EQ(interfaces, 1);
  EXPECT_EQ(endpoints, 2);
}

TEST(GloveFirmwareT9, RangeAndOutputAreReadAsTheDaemonWritesThem) {
  const GloveRange range{17, 801, 9, 1020, true};
  const auto bytes = encode_glove_range(range);
  glove_range read{};
  ASSERT_TRUE(glove_range_parse(bytes.data(), bytes.size(), &read));
  EXPECT_EQ(read.force_zero, 17);
  EXPECT_EQ(read.force_full, 801);
  EXPECT_EQ(read.potentiometer_low, 9);
  EXPECT_EQ(read.potentiometer_high, 1020);
  EXPECT_TRUE(read.calibrated);
  std::array<std::uint8_t, GLOVE_RANGE_SIZE> packed{};
  glove_range_pack(&read, packed.data());
  EXPECT_EQ(packed, bytes);

  const auto shown = encode_glove_output({1, 2, 3, 200, 1000});
  glove_output output{};
  ASSERT_TRUE(glove_output_parse(shown.data(), shown.size(), &output));
  EXPECT_EQ(output.blue, 3);
  EXPECT_EQ(output.vibration, 200);
  EXPECT_EQ(output.vibration_ms, 1000);
}

TEST(GloveFirmwareT9, WhatIsNoRangeOrOutputLeavesEverythingAsItWas) {
  const auto good = encode_glove_range({17, 801, 9, 1020, true});
  glove_range range{};
  glove_range_default(&range);
  // Every single wrong bit, as of an EEPROM that was being written when the plug was pulled.
  for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
    auto bad = good;
    bad[bit / 8] = static_cast<std::uint8_t>(bad[bit / 8] ^ 1u << (bit % 8));
    EXPECT_FALSE(glove_range_parse(bad.data(), bad.size(), &range)) << bit;
  }
  const std::array<std::uint8_t, GLOVE_RANGE_SIZE> erased = [] {
    std::array<std::uint8_t, GLOVE_RANGE_SIZE> out{};
    out.fill(0xFF);
    return out;
  }();
  EXPECT_FALSE(glove_range_parse(erased.data(), erased.size(), &range));
  for (const GloveRange& bad : {GloveRange{500, 500, 0, 1023, true}, GloveRange{0, 1024, 0, 1023, true},
                                GloveRange{0, 1023, 9, 8, true}}) {
    const auto bytes = encode_glove_range(bad);
    EXPECT_FALSE(glove_range_parse(bytes.data(), bytes.size(), &range));
  }
  EXPECT_FALSE(glove_range_parse(good.data(), 15, &range));
  EXPECT_EQ(range.force_full, GLOVE_ANALOGUE_MAX);
  EXPECT_FALSE(range.calibrated);
  glove_output output{};
  const auto too_long = encode_glove_output({1, 1, 1, 1, 1001});
  EXPECT_FALSE(glove_output_parse(too_long.data(), too_long.size(), &output));
  EXPECT_EQ(output.red, 0);
}

TEST(GloveFirmwareT9, PadsAreClosedWhereTheirPinsAreLow) {
  EXPECT_EQ(glove_contacts(0xFF), 0);
  EXPECT_EQ(glove_contacts(0x00), contact_all);
  EXPECT_EQ(glove_contacts(static_cast<std::uint8_t>(~contact_table)), contact_table);
}

TEST(GloveFirmwareT9, ASingleSpikeIsNoSample) {
  std::uint16_t spike[] = {500, 1023, 501, 0, 502};
  EXPECT_EQ(glove_median(spike, 5), 501);
  std::uint16_t one[] = {7};
  EXPECT_EQ(glove_median(one, 1), 7);
}

TEST(GloveFirmwareT9, APulseEndsByItselfAndNeverComesBack) {
  glove_pulse pulse{};
  glove_output output{};
  output.vibration = 90;
  output.vibration_ms = 20;
  const std::uint32_t began = 0xFFFFFF00u;  // Over the clock's wrap.
  glove_pulse_start(&pulse, &output, began);
  EXPECT_EQ(glove_pulse_level(&pulse, began + 19'999u), 90);
  EXPECT_EQ(glove_pulse_level(&pulse, began + 20'000u), 0);
  EXPECT_EQ(glove_pulse_level(&pulse, began + 5u), 0) << "the clock came round";
  output.vibration_ms = 0;
  glove_pulse_start(&pulse, &output, 0);
  EXPECT_EQ(glove_pulse_level(&pulse, 0), 0);
}

TEST(GloveFirmwareT9, ReportsAreDueEvery4msWithoutDriftOverTheWrap) {
  glove_schedule schedule{};
  std::uint32_t now = 0xFFFFF000u;
  EXPECT_EQ(glove_due(&schedule, now), 1);
  unsigned due = 0;
  // The loop's turns take 0.7 ms: the sum must not drift.
  for (int i = 0; i < 10'000; ++i) {
    now += 700;
    due += glove_due(&schedule, now);
  }
  EXPECT_EQ(due, 10'000u * 700u / GLOVE_REPORT_PERIOD_US);
  // A stall of 50 ms is counted, not caught up with.
  now = schedule.next_us + 50'000;
  EXPECT_EQ(glove_due(&schedule, now), 13);
  EXPECT_EQ(glove_due(&schedule, now), 0);
}

}  // namespace
}  // namespace handloft::tracking
