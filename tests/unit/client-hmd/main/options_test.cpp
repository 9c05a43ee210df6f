#include "client-hmd/main/options.h"

#include <gtest/gtest.h>

#include <vector>

#include "client-hmd/main/report.h"

namespace handloft::client {
namespace {

Result<ParsedOptions> parse(std::vector<const char*> words) {
  words.insert(words.begin(), "handloft-hmd");
  return parse_options(static_cast<int>(words.size()), words.data());
}

TEST(Options, ReadWhatTheDemonstrationAsksFor) {
  const auto parsed =
      parse({"--model", "unix:/tmp/m.sock", "--tracking", "unix:/tmp/t.sock", "--offscreen", "--size",
             "960x540", "--camera", "head", "--screenshot", "view.png", "--screenshot-when", "frames:30",
             "--report", "r.json", "--display-latency", "11"});
  ASSERT_TRUE(parsed.ok()) << parsed.error().describe();
  const HmdOptions& options = parsed->options;
  EXPECT_EQ(options.model->path, "/tmp/m.sock");
  EXPECT_EQ(options.tracking->path, "/tmp/t.sock");
  EXPECT_TRUE(options.offscreen);
  EXPECT_EQ(options.width_px, 960);
  EXPECT_EQ(options.height_px, 540);
  EXPECT_EQ(options.camera, CameraMode::head);
  EXPECT_EQ(options.screenshot_time, ScreenshotTime::frames);
  EXPECT_EQ(options.screenshot_frames, 30U);
  EXPECT_EQ(options.display_latency, std::chrono::milliseconds(11));
}

TEST(Options, ViewIsTheTableOrFitsTheScene) {
  EXPECT_EQ(parse({})->options.view, ViewChoice::table);
  EXPECT_EQ(parse({"--view", "fit"})->options.view, ViewChoice::fit);
  EXPECT_FALSE(parse({"--view", "nice"}).ok());
}

TEST(Options, ShowDistancesOnDemand_A28) {
  const auto plain = parse({});
  ASSERT_TRUE(plain.ok());
  EXPECT_FALSE(plain->options.distances);
  EXPECT_EQ(plain->options.distance_range_mm, 5.0);
  const auto shown = parse({"--distances", "--distance-range", "2.5"});
  ASSERT_TRUE(shown.ok()) << shown.error().describe();
  EXPECT_TRUE(shown->options.distances);
  EXPECT_EQ(shown->options.distance_range_mm, 2.5);
  EXPECT_FALSE(parse({"--distance-range", "0"}).ok());
}

TEST(Options, ShowStripesOnDemand) {
  const auto plain = parse({});
  ASSERT_TRUE(plain.ok());
  EXPECT_EQ(plain->options.shading, Shading::studio);
  const auto striped = parse({"--shading", "zebra"});
  ASSERT_TRUE(striped.ok()) << striped.error().describe();
  EXPECT_EQ(striped->options.shading, Shading::zebra);
  EXPECT_FALSE(parse({"--shading", "tiger"}).ok());
  EXPECT_EQ(parse({"--shading", "car-paint"})->options.shading, Shading::car_paint);
  const auto net = parse({"--overlay", "net,wires", "--edges", "trimmed", "--surroundings", "bare"});
  ASSERT_TRUE(net.ok());
  EXPECT_TRUE(net->options.overlays.control_nets && net->options.overlays.wires);
  EXPECT_EQ(net->options.edges, SurfaceEdges::trimmed);
  EXPECT_EQ(net->options.surroundings, Surroundings::bare);
  EXPECT_FALSE(parse({"--overlay", "stars"}).ok());
  const auto bent = parse({"--curvature", "gaussian", "--curvature-range", "20"});
  ASSERT_TRUE(bent.ok());
  EXPECT_EQ(bent->options.curvature, (CurvatureView{CurvatureKind::gaussian, 20.0F}));
  EXPECT_FALSE(parse({"--curvature", "sharp"}).ok());
}

TEST(Options, RefuseNonsenseNamingTheOption) {
  const auto field = [](std::vector<const char*> words) {
    const auto parsed = parse(std::move(words));
    return parsed.ok() ? std::string("accepted") : parsed.error().field;
  };
  EXPECT_EQ(field({"--size", "big"}), "size");
  EXPECT_EQ(field({"--size", "0x0"}), "size");
  EXPECT_EQ(field({"--size", "99999x2"}), "size");
  EXPECT_EQ(field({"--screenshot-when", "frames:0"}), "screenshot_when");
  EXPECT_EQ(field({"--screenshot-when", "soon"}), "screenshot_when");
  EXPECT_EQ(field({"--model", "carrier-pigeon:home"}), "model");
  EXPECT_EQ(field({"--once"}), "once");
  EXPECT_FALSE(parse({"--camera", "ceiling"}).ok());
}

TEST(Report, NamesTheFiguresThatTheSummaryReads) {
  RunFigures figures;
  figures.model.capture_to_receipt.add(std::chrono::milliseconds(10));
  figures.model.connects = 3;
  const std::string json = report_json(figures);
  for (const char* key : {"\"frames\"", "\"frame_ms\"", "\"capture_to_client_ms\"",
                          "\"capture_to_presentation_ms\"", "\"median\"", "\"p99\"", "\"reconnects\": 2"}) {
    EXPECT_NE(json.find(key), std::string::npos) << key << " in " << json;
  }
}

TEST(Options, OfSequencesNeedAFolderAndStandAlone_V8) {
  const auto turntable =
      parse({"--turntable", "round", "--frames", "24", "--elevation", "30", "--transparent"});
  ASSERT_TRUE(turntable.ok()) << turntable.error().describe();
  EXPECT_TRUE(turntable->options.shots.wanted());
  EXPECT_EQ(turntable->options.shots.frames, 24);
  EXPECT_TRUE(turntable->options.offscreen) << "no display is needed";
  EXPECT_TRUE(parse({"--script", "path.toml", "--pictures", "folder", "--overwrite"}).ok());
  EXPECT_FALSE(parse({})->options.shots.wanted());

  EXPECT_EQ(parse({"--script", "path.toml"}).error().field, "pictures");
  EXPECT_EQ(parse({"--pictures", "folder"}).error().field, "script");
  EXPECT_EQ(parse({"--turntable", "a", "--script", "b", "--pictures", "c"}).error().field, "script");
  EXPECT_EQ(parse({"--turntable", "a", "--report", "r.json"}).error().field, "turntable");
  EXPECT_FALSE(parse({"--turntable", "a", "--frames", "0"}).ok());
  EXPECT_FALSE(parse({"--turntable", "a", "--elevation", "90"}).ok());
}

}  // namespace
}  // namespace handloft::client
