// Health and alarms of devices (T12, T14).

#include "daemon-tracking/main/device_book.h"

#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>

#include <sstream>

namespace handloft::tracking {
namespace {

using namespace std::chrono_literals;
const Logger quiet("test", LogLevel::off);

TimePoint at(Duration since_start) {
  return from_ns(1'000'000'000) + since_start;
}

const DeviceReport& of(const std::vector<DeviceReport>& reports, const std::string& device) {
  for (const DeviceReport& report : reports)
    if (report.device == device) return report;
  static const DeviceReport none;
  return none;
}

DeviceFacts camera_facts(double asked_hz) {
  DeviceFacts facts;
  facts.device = "camera/left";
  facts.identity = "046d:082d serial 3F2A";
  facts.asked_rate_hz = asked_hz;
  return facts;
}

// `rate_hz` frames a second for a second, from `start` on.
void second_of_frames(DeviceBook& book, const std::string& device, Duration start, int rate_hz) {
  for (int i = 0; i < rate_hz; ++i) {
    const TimePoint time = at(start + i * 1s / rate_hz);
    book.note_sample(device, time, time);
  }
}

TEST(DeviceBook, TellsRateDropsAndIdentityT14) {
  DeviceBook book(quiet);
  book.set_facts(camera_facts(30));
  EXPECT_TRUE(book.note_sample("camera/left", at(0s), at(0s))) << "it was not there before";
  book.report(at(0s));
  second_of_frames(book, "camera/left", 10ms, 30);
  EXPECT_FALSE(book.note_sample("camera/left", at(990ms), at(990ms), 2));
  book.note_refused("camera/left");
  const DeviceReport report = of(book.report(at(1s)), "camera/left");
  EXPECT_NEAR(report.rate_hz, 31.0, 1e-9);
  EXPECT_EQ(report.samples, 32u);
  EXPECT_EQ(report.dropped, 2u);
  EXPECT_EQ(report.refused, 1u);
  EXPECT_EQ(report.identity, "046d:082d serial 3F2A");
  EXPECT_EQ(report.asked_rate_hz, 30.0);
  EXPECT_TRUE(report.present);
  EXPECT_EQ(report.problem, "");
}

TEST(DeviceBook, ASlowCameraIsAnAlarmAfterTwoSecondsT12) {
  DeviceBook book(quiet);
  book.set_facts(camera_facts(30));
  book.note_presence("camera/left", true, at(0s));
  book.report(at(0s));
  second_of_frames(book, "camera/left", 0s, 15);
  EXPECT_EQ(of(book.report(at(1s)), "camera/left").problem, "") << "one second may be a hiccup";
  second_of_frames(book, "camera/left", 1s, 15);
  EXPECT_NE(of(book.report(at(2s)), "camera/left").problem.find("slow: 15.0 frames a second where 30"),
            std::string::npos);
  second_of_frames(book, "camera/left", 2s, 30);
  EXPECT_EQ(of(book.report(at(3s)), "camera/left").problem, "") << "over as soon as it is in time again";
}

TEST(DeviceBook, ACameraThatDeliversNothingIsSlowToo) {
  DeviceBook book(quiet);
  book.set_facts(camera_facts(30));
  book.note_presence("camera/left", true, at(0s));
  for (int i = 0; i <= 2; ++i) book.report(at(i * 1s));
  EXPECT_NE(of(book.standing(), "camera/left").problem, "");
}

TEST(DeviceBook, AnAbsentCameraIsNotCalledSlow) {
  DeviceBook book(quiet);
  book.set_facts(camera_facts(30));
  book.note_presence("camera/left", true, at(0s));
  book.note_presence("camera/left", false, at(100ms));
  for (int i = 0; i <= 5; ++i) book.report(at(i * 1s));
  EXPECT_EQ(of(book.standing(), "camera/left").problem, "");
}

TEST(DeviceBook, GapsOfTheGloveAreAnAlarmT12) {
  DeviceBook book(quiet);
  book.note_presence("glove", true, at(0s));
  book.report(at(0s));
  second_of_frames(book, "glove", 0s, 250);
  book.note_sample("glove", at(999ms), at(999ms), 2);
  EXPECT_EQ(of(book.report(at(1s)), "glove").problem, "") << "single ones are a busy hub's";
  second_of_frames(book, "glove", 1s, 240);
  book.note_sample("glove", at(1999ms), at(1999ms), 9);
  EXPECT_NE(of(book.report(at(2s)), "glove").problem.find("9 of 250 reports were lost"), std::string::npos)
      << of(book.standing(), "glove").problem;
}

TEST(DeviceBook, WhatTheDriverSaysComesFirstThenThePlacement) {
  DeviceBook book(quiet);
  DeviceFacts facts = camera_facts(30);
  book.note_presence("camera/left", true, at(0s));
  book.set_placement_problem("camera/left", "the camera was moved");
  book.set_facts(facts);
  EXPECT_EQ(of(book.report(at(0s)), "camera/left").problem, "the camera was moved");
  facts.problem = "the exposure drifted";
  book.set_facts(facts);
  EXPECT_EQ(of(book.report(at(1s)), "camera/left").problem, "the exposure drifted");
}

TEST(DeviceBook, PresenceIsNewsOnlyWhenItChanges) {
  DeviceBook book(quiet);
  EXPECT_TRUE(book.note_presence("glove", false, at(0s))) << "nobody knew";
  EXPECT_FALSE(book.note_presence("glove", false, at(1s)));
  EXPECT_TRUE(book.note_presence("glove", true, at(2s)));
  EXPECT_TRUE(book.note_presence("glove", false, at(3s)));
}

TEST(DeviceBook, TheLogHearsOfAnAlarmOnceAndOfItsEnd) {
  std::ostringstream text;
  const Logger log("devices", LogLevel::info, std::make_shared<spdlog::sinks::ostream_sink_mt>(text));
  DeviceBook book(log);
  DeviceFacts facts = camera_facts(30);
  facts.problem = "no permission";
  book.set_facts(facts);
  for (int i = 0; i < 30; ++i) book.report(at(i * 1s));
  facts.problem.clear();
  book.set_facts(facts);
  for (int i = 30; i < 60; ++i) book.report(at(i * 1s));
  const std::string said = text.str();
  const auto count = [&](const std::string& words) {
    std::size_t times = 0;
    for (std::size_t i = said.find(words); i != std::string::npos; i = said.find(words, i + 1)) ++times;
    return times;
  };
  EXPECT_EQ(count("no permission"), 1u) << said;
  EXPECT_EQ(count("all is well again"), 1u) << said;
}

TEST(DeviceBook, AFlickeringAlarmDoesNotFillTheLog) {
  std::ostringstream text;
  const Logger log("devices", LogLevel::info, std::make_shared<spdlog::sinks::ostream_sink_mt>(text));
  DeviceBook book(log);
  DeviceFacts facts = camera_facts(0);
  for (int i = 0; i < 100; ++i) {
    facts.problem = i % 2 == 0 ? "flickers" : "";
    book.set_facts(facts);
    book.report(at(i * 1s));
  }
  const std::string said = text.str();
  EXPECT_LE(std::count(said.begin(), said.end(), '\n'), 11) << said;
}

// A worker still looks at the last frames when the camera is gone: they do not bring it back (T3).
TEST(DeviceBook, FramesFromBeforeADeviceWentDoNotBringItBack) {
  DeviceBook book(Logger("test", LogLevel::off));
  EXPECT_TRUE(book.note_sample("camera/left", at(0ms), at(4ms)));
  EXPECT_TRUE(book.note_presence("camera/left", false, at(100ms)));
  EXPECT_FALSE(book.note_sample("camera/left", at(120ms), at(98ms))) << "its clock may even run ahead";
  EXPECT_FALSE(book.standing()[0].present);
  EXPECT_TRUE(book.note_sample("camera/left", at(900ms), at(904ms)));
  EXPECT_TRUE(book.standing()[0].present);
}

}  // namespace
}  // namespace handloft::tracking
