#include "client-hmd/hud/hud.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace handloft::client {
namespace {

using std::chrono::milliseconds;

float half_an_em(std::string_view text) {
  return 0.5F * static_cast<float>(text.size());
}

std::string all_text(const HudStatus& status) {
  std::string out;
  for (const OverlayText& text : layout_hud(status, 1280, 720, half_an_em).texts) out += text.text + "|";
  return out;
}

HudStatus live() {
  HudStatus status;
  status.model_connected = status.has_scene = status.tracking_connected = status.tracking_wanted = true;
  status.shapes = 1;
  status.points = 12;
  return status;
}

TEST(Hud, SaysHowTheConnectionIs) {
  EXPECT_THAT(all_text({}), testing::HasSubstr("Connecting"));
  EXPECT_THAT(all_text(live()), testing::HasSubstr("Live"));
  HudStatus gone = live();
  gone.model_connected = false;
  EXPECT_THAT(all_text(gone), testing::HasSubstr("Reconnecting"));
  HudStatus blind = live();
  blind.tracking_connected = false;
  EXPECT_THAT(all_text(blind), testing::HasSubstr("No tracking"));
}

TEST(Hud, ShowsALagFromAQuarterSecondOn_V5) {
  HudStatus status = live();
  status.lag = milliseconds(249);
  EXPECT_THAT(all_text(status), testing::Not(testing::HasSubstr("behind")));
  status.lag = milliseconds(1300);
  EXPECT_THAT(all_text(status), testing::HasSubstr("1.3 s behind"));
}

TEST(Hud, LagIsBetweenTheHandAndTheModel_V5) {
  const TimePoint now = from_ns(10'000'000'000);
  TrackingStatus tracking;
  ModelState model;
  EXPECT_FALSE(model_lag(tracking, model, now)) << "nothing is known";
  tracking.connected = true;
  tracking.frames = 10;
  tracking.capture_time = now - milliseconds(20);
  tracking.received_at = now - milliseconds(5);
  EXPECT_FALSE(model_lag(tracking, model, now)) << "this server says nothing of captures";
  model.has_capture_time = true;
  model.capture_time = now - milliseconds(420);
  EXPECT_EQ(model_lag(tracking, model, now), milliseconds(400));
  tracking.received_at = now - milliseconds(600);
  EXPECT_FALSE(model_lag(tracking, model, now)) << "the hand rests";
}

TEST(Hud, StaysInsideThePictureAtAnySize) {
  HudStatus status = live();
  status.hand = HandStatus{v1::GESTURE_OPEN, 0.7, true, true, 80};
  status.tool = "laying points";
  status.range = 1.0F;
  status.symmetry = true;
  status.target = "side";
  status.latency_ms = 11.0;
  status.references = status.compared = 1;
  status.distances = DistanceScale{};
  status.alternatives = {"flat", {"main", "flat"}};
  status.selected = "top";
  status.representation = Representation::both;
  status.history.undo_steps = 3;
  for (const auto& [width, height] : {std::pair{1280, 720}, std::pair{1920, 1080}, std::pair{960, 540}}) {
    const Overlay overlay = layout_hud(status, width, height, half_an_em);
    ASSERT_GE(overlay.panels.size(), 6U);
    for (const OverlayPanel& panel : overlay.panels) {
      EXPECT_GE(panel.position.x, 0.0F);
      EXPECT_GE(panel.position.y, 0.0F);
      EXPECT_LE(panel.position.x + panel.size.x, static_cast<float>(width));
      EXPECT_LE(panel.position.y + panel.size.y, static_cast<float>(height));
    }
  }
}

TEST(Hud, TellsModeRangeAndTarget_A25) {
  HudStatus status = live();
  status.hand = HandStatus{v1::GESTURE_POINTING, 0.0, false, true, 80};
  status.mode = "boundary";
  EXPECT_THAT(all_text(status), testing::HasSubstr("draws boundary"));
  status.hand->gesture = v1::GESTURE_CLOSED;
  status.range = 0.42F;
  status.target = "side";
  EXPECT_THAT(all_text(status), testing::HasSubstr("Range 42 %, literal falloff"));
  status.smooth_falloff = true;
  EXPECT_THAT(all_text(status), testing::HasSubstr("Range 42 %, smooth falloff"));
  EXPECT_THAT(all_text(status), testing::Not(testing::HasSubstr("draws")));
  EXPECT_THAT(all_text(status), testing::HasSubstr("acts on side"));
}

TEST(Hud, NamesThePresentAlternativeWhenThereAreSeveral_A28) {
  HudStatus status = live();
  status.alternatives = {"main", {"main"}};
  EXPECT_THAT(all_text(status), testing::Not(testing::HasSubstr("Alternative")));
  status.alternatives = {"flat", {"main", "flat", "round"}};
  EXPECT_THAT(all_text(status), testing::HasSubstr("Alternative|flat|2 of 3"));
  status.alternatives.present = status.alternatives.names[1] = std::string(39, 'x') + "ü and more";
  EXPECT_THAT(all_text(status), testing::HasSubstr(std::string(39, 'x') + "…|")) << "cut between characters";
}

TEST(Hud, LegendStatesTheRangeOfDistances_A28) {
  HudStatus status = live();
  status.references = status.compared = 1;
  EXPECT_THAT(all_text(status), testing::HasSubstr("1 reference|"));
  EXPECT_THAT(all_text(status), testing::Not(testing::HasSubstr("mm"))) << "not shown";
  status.distances = DistanceScale{};
  EXPECT_THAT(all_text(status), testing::AllOf(testing::HasSubstr("−5 mm|"), testing::HasSubstr("+5 mm|")));
  status.distances->range_m = 0.0125F;
  EXPECT_THAT(all_text(status), testing::HasSubstr("+12.5 mm|"));
  status.compared = 0;
  EXPECT_THAT(all_text(status), testing::HasSubstr("not measured yet"));
  status.references = 0;
  EXPECT_THAT(all_text(status), testing::HasSubstr("no reference"));
}

TEST(Hud, LegendRunsFromBlueToOrange_A28) {
  HudStatus status = live();
  const std::size_t before = layout_hud(status, 1280, 720, half_an_em).panels.size();
  status.references = status.compared = 1;
  status.distances = DistanceScale{};
  const std::vector<OverlayPanel> panels = layout_hud(status, 1280, 720, half_an_em).panels;
  ASSERT_GT(panels.size(), before + 3);
  const OverlayPanel& first = panels[before + 1];
  const OverlayPanel& last = panels.back();
  EXPECT_LT(first.position.x, last.position.x);
  EXPECT_GT(first.fill.b, first.fill.r + 0.3F);
  EXPECT_GT(last.fill.r, last.fill.b + 0.5F);
}

TEST(Hud, PressureBarGrowsWithPressure_V7) {
  HudStatus status = live();
  const auto filled = [&status](double pressure) {
    status.hand = HandStatus{v1::GESTURE_OPEN, pressure, true, true, 80};
    const Overlay overlay = layout_hud(status, 1280, 720, half_an_em);
    float widest = 0.0F;
    for (const OverlayPanel& panel : overlay.panels) {
      if (panel.fill.r > 0.85F && panel.fill.b < 0.3F) widest = std::max(widest, panel.size.x);
    }
    return widest;
  };
  EXPECT_EQ(filled(0.0), 0.0F);
  EXPECT_NEAR(filled(1.0) / filled(0.5), 2.0F, 1e-4F);
}

}  // namespace
}  // namespace handloft::client
