// The guided tour (V6, V7) goes on when the scene shows that a step is done, and not before.

#include "client-hmd/hud/tour.h"

#include <gtest/gtest.h>

#include <set>

namespace handloft::client {
namespace {

Tour begun() {
  Tour tour{HudSettings{}};
  tour.look({});
  return tour;
}

TourSight after(std::uint32_t steps, std::string last, std::size_t points = 40) {
  TourSight sight;
  sight.points = points;
  sight.undo_steps = steps;
  sight.last_step = std::move(last);
  return sight;
}

TEST(Tour, GoesFromAnEmptyTableToAFile_V6) {
  Tour tour = begun();
  EXPECT_EQ(tour.state(), Tour::State::running);
  EXPECT_EQ(tour.step(), TourStep::lay);
  TourSight sight = after(1, "Lay 11 points in \"shape-1\"", 11);
  tour.look(sight);
  EXPECT_EQ(tour.step(), TourStep::lay) << "eleven are not enough";
  sight.points = 12;
  tour.look(sight);
  EXPECT_EQ(tour.step(), TourStep::fit);

  sight.undo_steps = 2;
  sight.last_step = "Fit \"shape-1\"";
  sight.surfaces = 1;
  tour.look(sight);
  EXPECT_EQ(tour.step(), TourStep::push);

  sight.undo_steps = 3;
  sight.last_step = "Push 9 points of \"shape-1\"";
  tour.look(sight);
  EXPECT_EQ(tour.step(), TourStep::push) << "the surface is not to be seen";
  sight.surface_shown = true;
  tour.look(sight);
  EXPECT_EQ(tour.step(), TourStep::trim);

  sight.undo_steps = 4;
  sight.boundaries = 1;
  sight.last_step = "Trim \"shape-1\" with a curve of 40 places";
  tour.look(sight);
  EXPECT_EQ(tour.step(), TourStep::finish);

  sight.exports = 1;
  tour.look(sight);
  EXPECT_EQ(tour.state(), Tour::State::finished);
  HudSettings settings;
  tour.remember(settings);
  EXPECT_TRUE(settings.tour_done);
  tour.dismiss();
  EXPECT_EQ(tour.state(), Tour::State::ended);
}

TEST(Tour, TakesAnUndoForItsEnd) {
  HudSettings settings;
  settings.tour_step = 4;
  Tour tour(settings);
  TourSight sight = after(4, "Trim");
  sight.redo_steps = 1;
  tour.look(sight);
  tour.look(sight);
  EXPECT_EQ(tour.state(), Tour::State::running) << "what was undone before does not count";
  sight.redo_steps = 2;
  tour.look(sight);
  EXPECT_EQ(tour.state(), Tour::State::finished);
}

TEST(Tour, CountsOnlyWhatHappensDuringAStep) {
  Tour tour{HudSettings{}};
  tour.look(after(9, "Fit \"old\"", 500));
  tour.look(after(9, "Fit \"old\"", 500));
  EXPECT_EQ(tour.step(), TourStep::lay);
  // Points that are deleted and laid anew are new.
  tour.look(after(10, "Delete points", 480));
  tour.look(after(11, "Add 12 points to \"old\"", 492));
  EXPECT_EQ(tour.step(), TourStep::fit);
}

TEST(Tour, IsSkippedEndedAndRepeated) {
  Tour tour = begun();
  for (int i = 0; i < tour_steps; ++i) {
    EXPECT_EQ(tour.step_number(), i);
    tour.skip_step();
  }
  EXPECT_EQ(tour.state(), Tour::State::finished);
  tour.repeat();
  tour.look({});
  EXPECT_EQ(tour.state(), Tour::State::running);
  EXPECT_EQ(tour.step(), TourStep::lay);
  tour.skip_step();
  tour.end();
  EXPECT_EQ(tour.state(), Tour::State::ended);
  tour.look(after(1, "Lay 99 points", 99));
  tour.skip_step();
  EXPECT_EQ(tour.state(), Tour::State::ended) << "it does not come back by itself";
}

TEST(Tour, GoesOnWhereItWasLeft) {
  Tour tour = begun();
  tour.skip_step();
  tour.skip_step();
  HudSettings settings;
  tour.remember(settings);
  EXPECT_FALSE(settings.tour_done);
  Tour again(settings);
  again.look({});
  EXPECT_EQ(again.step(), TourStep::push);
  settings.tour_done = true;
  EXPECT_EQ(Tour(settings).state(), Tour::State::ended);
  settings = {};
  settings.tour_step = 99;
  EXPECT_EQ(Tour(settings).step(), TourStep::finish) << "whatever the settings hold";
}

TEST(Tour, SaysSomethingElseAtEveryStep) {
  std::set<std::string_view> titles;
  for (int i = 0; i < tour_steps; ++i) {
    const TourText& text = tour_text(static_cast<TourStep>(i));
    titles.insert(text.title);
    EXPECT_LE(text.title.size(), 24U);
    EXPECT_LE(text.hint.size(), 26U) << "beside the cursor there is little room";
    EXPECT_LE(text.task.size(), 90U);
    EXPECT_FALSE(text.why.empty());
  }
  EXPECT_EQ(titles.size(), static_cast<std::size_t>(tour_steps));
}

TEST(Tour, SeesWhatASceneHolds) {
  Scene scene;
  auto shape = std::make_shared<Entity>();
  auto points = std::make_shared<PointSet>();
  points->points.resize(30);
  shape->points = points;
  shape->surface = std::make_shared<SurfaceMesh>();
  auto curves = std::make_shared<std::vector<SceneCurve>>(2);
  (*curves)[0].kind = CurveKind::boundary;
  (*curves)[0].closed = true;
  (*curves)[1].kind = CurveKind::boundary;  // Open: still being drawn.
  shape->curves = curves;
  shape->representation = Representation::surface;
  scene.entities["shape-1"] = shape;
  auto reference = std::make_shared<Entity>(*shape);
  reference->kind = EntityKind::reference;
  scene.entities["reference-1"] = reference;
  scene.history = {5, 1, "Fit", "Push", "", ""};
  TourSight sight = tour_sight(scene, 2);
  EXPECT_EQ(sight.points, 30U);
  EXPECT_EQ(sight.surfaces, 1U);
  EXPECT_EQ(sight.boundaries, 1U);
  EXPECT_TRUE(sight.surface_shown);
  EXPECT_EQ(sight.undo_steps, 5U);
  EXPECT_EQ(sight.last_step, "Fit");
  EXPECT_EQ(sight.exports, 2U);
  auto in_the_air = std::make_shared<Entity>(*shape);
  in_the_air->provisional = true;
  in_the_air->settled_points = 4;
  scene.entities["shape-1"] = in_the_air;
  EXPECT_EQ(tour_sight(scene, 0).points, 4U);
}

}  // namespace
}  // namespace handloft::client
