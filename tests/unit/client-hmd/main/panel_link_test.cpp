// Between panels and the rest, as far as it needs no graphics (V7).

#include "client-hmd/main/panel_link.h"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/test_data.h"

namespace handloft::client {
namespace {

TEST(PanelLink, PassesEverythingThroughWithoutPanels) {
  const handloft::test::TemporaryDirectory folder;
  const SystemClock clock;
  const Logger log("test");
  PanelLink link({}, log);
  const auto feed =
      ModelFeed::start(net::parse_endpoint("unix:" + (folder.path() / "none").string()).value(), clock, log);
  HmdOptions options;
  ViewState view(options);
  const std::vector<InputEvent> events{{TimePoint{}, {}, PointerMoved{{3.0, 4.0}}},
                                       {TimePoint{}, {}, KeyChanged{"F1", true, false}}};
  const PanelledInput input = link.take(events, *feed, view, clock.now());
  EXPECT_EQ(input.events.size(), 2U);
  EXPECT_TRUE(input.commands.empty());
  EXPECT_FALSE(input.taken.pointer);
  EXPECT_FALSE(link.free_part().has_value());
}

TEST(PanelLink, HasTheColoursOfThePersonsSettings) {
  const handloft::test::TemporaryDirectory folder;
  std::ofstream(folder.path() / "hmd.toml") << "colours = \"colour-blind-safe\"\n";
  const Logger log("test");
  EXPECT_EQ(PanelLink(folder.path() / "hmd.toml", log).colours(), ColourScheme::colour_blind_safe);
  EXPECT_EQ(PanelLink({}, log).colours(), ColourScheme::normal);
}

TEST(PanelLink, ShowsTheViewAsItIs) {
  HmdOptions options;
  options.shading = Shading::zebra;
  options.overlays.wires = true;
  options.distances = true;
  options.camera = CameraMode::head;
  const ViewChoices choices = view_choices(ViewState(options));
  EXPECT_EQ(choices.shading, Shading::zebra);
  EXPECT_TRUE(choices.overlays.wires);
  EXPECT_TRUE(choices.distances);
  EXPECT_TRUE(choices.follow_head);
}

}  // namespace
}  // namespace handloft::client
