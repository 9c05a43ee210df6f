// The Chrome trace: JSON that a viewer reads, bounded memory.

#include "daemon-tracking/main/trace_log.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/test_data.h"

namespace handloft::tracking {
namespace {

using namespace std::chrono_literals;

TEST(TraceLog, SpansBecomeCompleteEventsInOrder) {
  TraceLog log;
  log.add({from_ns(5'000'000), 2ms, 1, 7, TraceStage::decode});
  log.add({from_ns(1'000'500), 4ms, 0, 3, TraceStage::capture});
  const nlohmann::json document = nlohmann::json::parse(log.to_json({"left \"\n", "right"}), nullptr, false);
  ASSERT_TRUE(document.is_object());
  std::vector<nlohmann::json> spans;
  for (const auto& event : document["traceEvents"])
    if (event["ph"] == "X") spans.push_back(event);
  ASSERT_EQ(spans.size(), 2u);
  EXPECT_EQ(spans[0]["name"], "capture");
  EXPECT_DOUBLE_EQ(spans[0]["ts"].get<double>(), 1000.5) << "microseconds";
  EXPECT_DOUBLE_EQ(spans[0]["dur"].get<double>(), 4000.0);
  EXPECT_EQ(spans[0]["args"]["frame"], 3);
  EXPECT_EQ(spans[1]["pid"], 1) << "a camera a process";
}

TEST(TraceLog, TheNewestAreKept) {
  TraceLog log(10);
  for (int i = 0; i < 25; ++i)
    log.add({from_ns(1'000 * i), 1us, 0, static_cast<std::uint64_t>(i), TraceStage::tags});
  EXPECT_EQ(log.forgotten(), 15u);
  const nlohmann::json document = nlohmann::json::parse(log.to_json({}), nullptr, false);
  std::vector<int> frames;
  for (const auto& event : document["traceEvents"])
    if (event["ph"] == "X") frames.push_back(event["args"]["frame"]);
  EXPECT_EQ(frames, (std::vector<int>{15, 16, 17, 18, 19, 20, 21, 22, 23, 24}));
}

TEST(TraceLog, AnEmptyOneIsStillATrace) {
  EXPECT_TRUE(nlohmann::json::parse(TraceLog().to_json({}), nullptr, false).is_object());
}

TEST(TraceLog, AFileThatCannotBeWrittenIsNamed) {
  const Status written = TraceLog().write("/does/not/exist.json", {});
  ASSERT_FALSE(written.ok());
  EXPECT_NE(written.error().describe().find("/does/not/exist.json"), std::string::npos);
}

}  // namespace
}  // namespace handloft::tracking
