#include "daemon-tracking/main/report.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/test_data.h"

namespace handloft::tracking {
namespace {

SessionFigures some_figures() {
  SessionFigures figures;
  figures.source = {{"simulate", "mouse"}};
  CameraFigures camera;
  camera.name = "left";
  camera.frames = 30;
  camera.dropped = 2;
  camera.missing = 3;
  camera.vision_ms.add(1.5);
  figures.cameras.push_back(camera);
  figures.published = 28;
  figures.problem = "io: the disk is full";
  figures.accuracy.fingertips_m.add(0.001);
  figures.capture_to_publish_ms.add(7.0);
  return figures;
}

TEST(Report, IsJsonInTheUnitsItNames) {
  const auto json = nlohmann::json::parse(to_json(some_figures()));
  EXPECT_EQ(json["source"]["simulate"], "mouse");
  EXPECT_EQ(json["cameras"][0]["name"], "left");
  EXPECT_EQ(json["cameras"][0]["dropped"], 2);
  EXPECT_EQ(json["cameras"][0]["missing"], 3);
  EXPECT_EQ(json["cameras"][0]["vision_ms"]["p50"], 1.5);
  EXPECT_EQ(json["published"], 28);
  EXPECT_EQ(json["problem"], "io: the disk is full");
  EXPECT_DOUBLE_EQ(json["accuracy"]["fingertips_mm"]["rms"], 1.0) << "metres become millimetres";
  EXPECT_EQ(json["capture_to_publish_ms"]["p99"], 7.0);
}

TEST(Report, OfNothingIsFiniteToo) {
  const auto json = nlohmann::json::parse(to_json(SessionFigures{}));
  EXPECT_EQ(json["accuracy"]["fingertips_mm"]["rms"], 0.0);
  EXPECT_EQ(json["problem"], "");
}

TEST(Report, WritesTheFileOrNamesIt) {
  const test::TemporaryDirectory folder;
  ASSERT_TRUE(write_report(some_figures(), folder.path() / "r.json").ok());
  std::ifstream in(folder.path() / "r.json");
  EXPECT_EQ(nlohmann::json::parse(in)["published"], 28);
  const Status refused = write_report(some_figures(), folder.path() / "none" / "r.json");
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().describe().find("none/r.json"), std::string::npos);
}

}  // namespace
}  // namespace handloft::tracking
