// Everything that can be modelled with mouse and keys (V6), from events to the document: where the pointer
// went is where the shape is, to below a millimetre.

#include <cmath>
#include <numeric>

#include "server-model/model/sculpt_shape.h"
#include "tests/integration/client-hmd/desktop_room.h"

namespace handloft::client::test {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double table_m = 0.05;  ///< The work plane at first.
constexpr double well_below_mm_m = 1e-4;

double distance_to_path(const Vector3d& at, const std::vector<glm::dvec3>& path) {
  double best = 1e9;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Vector3d a(path[i - 1].x, path[i - 1].y, path[i - 1].z);
    const Vector3d b(path[i].x, path[i].y, path[i].z);
    const double t = std::clamp((at - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
    best = std::min(best, (at - a - t * (b - a)).norm());
  }
  return best;
}

class DesktopModelling : public DesktopRoom {
 protected:
  /// Four strokes on the level plane over 12 cm x 9 cm, fitted; both shown.
  void lay_a_sheet() {
    for (const double y : {-0.045, -0.015, 0.015, 0.045}) {
      drag_through({{-0.06, y, table_m}, {0.06, y, table_m}});
    }
    key("Enter");
    frame();
    key("B");
    frame();
    ASSERT_THAT(problems_, IsEmpty());
    ASSERT_EQ(mirror_.scene()->entities.size(), 1U);
    ASSERT_TRUE(mirror_.scene()->entities.begin()->second->surface != nullptr);
    done_.clear();
  }
  void make_sculpted_sheet() {
    v1::Operation operation;
    v1::CreateSculptSurface& create = *operation.mutable_create_sculpt_surface();
    create.set_id("sheet");
    create.mutable_rectangle()->mutable_pose()->mutable_position()->set_z(0.1);
    create.mutable_rectangle()->set_width_m(0.3);
    create.mutable_rectangle()->set_depth_m(0.2);
    create.set_control_u(14);
    create.set_control_v(12);
    submit(operation);
    frame();
  }
  model::SculptPtr sheet() const { return model::as_sculpt(model_.document().find("sheet")); }
};

TEST_F(DesktopModelling, AStrokeLiesWhereThePointerWentOnTheWorkPlane_A1) {
  const std::vector<glm::dvec3> path{{-0.05, 0.0, table_m}, {0.05, 0.03, table_m}};
  drag_through(path);
  ASSERT_EQ(done_.size(), 1U);
  const auto& points = shape("shape-1").points;
  EXPECT_GT(points.size(), 30U);
  double worst = 0;
  for (const model::DualPoint& point : points)
    worst = std::max(worst, distance_to_path(point.position(), path));
  EXPECT_LT(worst, well_below_mm_m);
  EXPECT_NEAR((points[0].position() - Vector3d(-0.05, 0, table_m)).norm(), 0.0, well_below_mm_m);
  EXPECT_THAT(problems_, IsEmpty());
}

TEST_F(DesktopModelling, CornersAreKeptAtFiveFramesASecond) {
  frame_interval_ = 200ms;
  const std::vector<glm::dvec3> zigzag{{-0.06, -0.02, table_m},
                                       {-0.03, 0.03, table_m},
                                       {0.0, -0.02, table_m},
                                       {0.03, 0.03, table_m},
                                       {0.06, -0.02, table_m}};
  drag_through(zigzag);
  ASSERT_EQ(done_.size(), 1U);
  for (const glm::dvec3& corner : zigzag) {
    double nearest = 1;
    for (const model::DualPoint& point : shape("shape-1").points) {
      nearest = std::min(nearest, (point.position() - Vector3d(corner.x, corner.y, corner.z)).norm());
    }
    EXPECT_LT(nearest, 0.0011) << corner.x;
  }
}

TEST_F(DesktopModelling, PressureIsHeldByShiftAndControlAndSetByTheWheelAndThePen_A1) {
  const auto pressure_of_next = [&] {
    drag_through({{0.0, 0.0, table_m}, {0.02, 0.0, table_m}});
    return last().add_points().points(0).pressure();
  };
  EXPECT_DOUBLE_EQ(pressure_of_next(), 0.5);
  modifiers_.shift = true;
  EXPECT_DOUBLE_EQ(pressure_of_next(), 0.95);
  modifiers_ = {};
  modifiers_.control = true;
  EXPECT_DOUBLE_EQ(pressure_of_next(), 0.15);
  modifiers_ = {};
  key(".");
  EXPECT_DOUBLE_EQ(pressure_of_next(), 0.6);
  event(PenPressed{0.37});
  EXPECT_DOUBLE_EQ(pressure_of_next(), 0.37);
  event(PenPressed{0.0});
  EXPECT_DOUBLE_EQ(pressure_of_next(), 0.6);
}

TEST_F(DesktopModelling, AStrokesPressureFollowsThePenAlongIt_A1) {
  move_to(pixel({-0.05, 0, table_m}));
  event(PenPressed{0.2});
  press();
  for (int i = 1; i <= 50; ++i) {
    event(PenPressed{0.2 + 0.012 * i});
    move_to(pixel({-0.05 + 0.002 * i, 0, table_m}));
  }
  release();
  event(PenPressed{0.0});
  frame();
  ASSERT_EQ(done_.size(), 1U);
  for (const v1::Point& point : last().add_points().points()) {
    EXPECT_NEAR(point.pressure(), 0.2 + 6.0 * (point.position().x() + 0.05), 0.02);
  }
}

TEST_F(DesktopModelling, ASurfaceIsPushedOutwardsByMovingUp_A14) {
  lay_a_sheet();
  key("2");
  // Of the sheet's strokes one passes here; the disk of pressure 0.5 is 32 mm.
  const glm::dvec3 at(0.0, 0.015, table_m);
  const glm::dvec3 up(0.0, 0.015, table_m + 0.02);
  drag_through({at, up});
  ASSERT_EQ(done_.size(), 1U) << testing::PrintToString(problems_);
  ASSERT_TRUE(last().has_push_points());
  double highest = 0;
  for (const model::DualPoint& point : shape("shape-1").points)
    highest = std::max(highest, point.position().z());
  EXPECT_NEAR(highest, table_m + 0.02, 0.0005);
}

TEST_F(DesktopModelling, AndInwardsByMovingDown_A14) {
  lay_a_sheet();
  key("2");
  drag_through({{0.0, 0.015, table_m}, {0.0, 0.015, table_m - 0.015}});
  ASSERT_EQ(done_.size(), 1U) << testing::PrintToString(problems_);
  double lowest = 1;
  for (const model::DualPoint& point : shape("shape-1").points)
    lowest = std::min(lowest, point.position().z());
  EXPECT_NEAR(lowest, table_m - 0.015, 0.0005);
}

TEST_F(DesktopModelling, ThePushsRangeIsTheKeys_A16) {
  lay_a_sheet();
  key("2");
  for (int i = 0; i < 4; ++i) key("]");
  drag_through({{0.0, 0.015, table_m}, {0.0, 0.015, table_m + 0.01}});
  ASSERT_EQ(done_.size(), 1U);
  EXPECT_NEAR(last().push_points().range(), 0.5, 1e-9);
}

TEST_F(DesktopModelling, AProfileIsDrawnInThePlaneThroughTheShapeWhereItBegins_A19) {
  lay_a_sheet();
  key("3");
  key("P");  // Front.
  const std::vector<glm::dvec3> arch{{-0.05, 0.0, table_m},
                                     {-0.02, 0.0, table_m + 0.012},
                                     {0.02, 0.0, table_m + 0.012},
                                     {0.05, 0.0, table_m}};
  drag_through(arch);
  ASSERT_EQ(done_.size(), 1U) << testing::PrintToString(problems_);
  ASSERT_TRUE(last().has_modify_profile());
  for (const v1::Point& point : last().modify_profile().curves(0).points()) {
    const Vector3d at(point.position().x(), point.position().y(), point.position().z());
    EXPECT_LT(distance_to_path(at, arch), 0.0005);
  }
}

TEST_F(DesktopModelling, TrimsToWhatIsEncircled_A24) {
  lay_a_sheet();
  key("4");
  std::vector<glm::dvec3> circle;
  for (int i = 0; i <= 40; ++i) {
    const double angle = 2 * M_PI * i / 40;
    circle.emplace_back(0.03 * std::cos(angle), 0.03 * std::sin(angle), table_m);
  }
  drag_through(circle);
  ASSERT_EQ(done_.size(), 1U) << testing::PrintToString(problems_);
  ASSERT_TRUE(last().has_set_boundary());
  for (const v1::Vec3& at : last().set_boundary().curve()) {
    EXPECT_NEAR(std::hypot(at.x(), at.y()), 0.03, 0.0005);
    EXPECT_NEAR(at.z(), table_m, 0.0005);
  }
}

TEST_F(DesktopModelling, MovesTurnsAndScalesAShape_A28) {
  lay_a_sheet();
  key("5");
  move_to(pixel({0.0, 0.0, table_m}));
  frame();
  press();
  go_to(pixel({0.03, 0.02, table_m}));
  for (int i = 0; i < 4; ++i) key("Q");
  for (int i = 0; i < 10; ++i) key("]");
  wait(200ms);
  release();
  frame();
  ASSERT_EQ(done_.size(), 1U) << testing::PrintToString(problems_);
  const v1::TransformEntities& move = last().transform();
  EXPECT_NEAR(move.translation().x(), 0.03, 0.0005);
  EXPECT_NEAR(move.translation().y(), 0.02, 0.0005);
  EXPECT_NEAR(move.translation().z(), 0.0, 0.0005);
  EXPECT_NEAR(2 * std::atan2(move.rotation().z(), move.rotation().w()), M_PI / 6, 1e-4);
  EXPECT_NEAR(move.scale(), std::exp2(0.5), 1e-6);
}

TEST_F(DesktopModelling, TheHeldKeyTurnsByThePointer_A28) {
  lay_a_sheet();
  key("5");
  move_to(pixel({0.0, 0.0, table_m}));
  frame();
  press();
  event(KeyChanged{"R", true, false});
  go_to(at_px_ + glm::dvec2(120.0, 0.0));
  event(KeyChanged{"R", false, false});
  wait(200ms);
  release();
  frame();
  ASSERT_EQ(done_.size(), 1U);
  const v1::TransformEntities& move = last().transform();
  EXPECT_NEAR(std::hypot(move.translation().x(), move.translation().y(), move.translation().z()), 0.0, 1e-6);
  EXPECT_NEAR(2 * std::acos(move.rotation().w()), M_PI * 120 / 720, 1e-3);
}

TEST_F(DesktopModelling, IconsAreTappedDrawnSpannedAndDragged_D6_D19) {
  make_sculpted_sheet();
  key("3");
  drag_through({{0.05, 0.02, 0.1}});
  drag_through({{-0.1, -0.05, 0.1}, {0.1, -0.05, 0.1}});
  key("6");
  drag_through({{-0.1, 0.03, 0.1}, {-0.05, 0.07, 0.1}});
  ASSERT_EQ(sheet()->icons->size(), 3U) << testing::PrintToString(problems_);
  EXPECT_NEAR(((*sheet()->icons)[0].place - Vector3d(0.05, 0.02, 0.1)).norm(), 0.0, 0.0005);
  EXPECT_EQ((*sheet()->icons)[1].shape, model::IconShape::curve);
  EXPECT_EQ((*sheet()->icons)[2].shape, model::IconShape::region);

  key("2");
  done_.clear();
  drag_through({{0.05, 0.02, 0.1}, {0.05, 0.02, 0.125}});
  ASSERT_EQ(done_.size(), 1U) << testing::PrintToString(problems_);
  EXPECT_NEAR(last().drag_icon().translation().z(), 0.025, 0.0005);
  EXPECT_NEAR(std::hypot(last().drag_icon().translation().x(), last().drag_icon().translation().y()), 0.0,
              1e-4);
  EXPECT_NEAR(((*sheet()->icons)[0].place - Vector3d(0.05, 0.02, 0.125)).norm(), 0.0, 0.0006);
}

TEST_F(DesktopModelling, TwoTapsSpanARegionToo_D11) {
  make_sculpted_sheet();
  key("6");
  drag_through({{-0.1, -0.05, 0.1}});
  EXPECT_THAT(std::string(desktop_.state().hint), HasSubstr("other corner"));
  drag_through({{0.0, 0.03, 0.1}});
  ASSERT_EQ(sheet()->icons->size(), 1U) << testing::PrintToString(problems_);
  EXPECT_EQ((*sheet()->icons)[0].shape, model::IconShape::region);
}

TEST_F(DesktopModelling, ATangentIsTurnedByKeys_D7) {
  make_sculpted_sheet();
  key("3");
  drag_through({{0.0, 0.0, 0.1}});
  key("I");
  frame();
  ASSERT_EQ((*sheet()->icons)[0].property, model::IconProperty::tangent_u);
  key("2");
  done_.clear();
  move_to(pixel({0.0, 0.0, 0.1}));
  frame();
  press();
  key("Right");
  wait(200ms);
  release();
  frame();
  ASSERT_EQ(done_.size(), 1U) << testing::PrintToString(problems_);
  ASSERT_TRUE(last().has_drag_icon());
  EXPECT_NEAR(2 * std::acos(last().drag_icon().rotation().w()), M_PI / 24, 1e-3);
}

TEST_F(DesktopModelling, ACurveIconBendsWithinItsReach_D19) {
  make_sculpted_sheet();
  key("3");
  drag_through({{-0.1, 0.0, 0.1}, {0.1, 0.0, 0.1}});
  key("2");
  done_.clear();
  move_to(pixel({0.05, 0.0, 0.1}));
  frame();
  for (int i = 0; i < 14; ++i) key("[");  // Over an icon: the reach of the bend.
  EXPECT_EQ(desktop_.state().range_words, "bend");
  press();
  go_to(pixel({0.05, 0.0, 0.12}));
  release();
  frame();
  ASSERT_EQ(done_.size(), 1U) << testing::PrintToString(problems_);
  EXPECT_NEAR(last().drag_icon().reach_m(), 0.3 * 0.2, 0.002);
  EXPECT_NEAR(last().drag_icon().held_at(), 0.75, 0.02);
}

TEST_F(DesktopModelling, EscapeTakesBackWhatIsInTheAir) {
  move_to(pixel({0.0, 0.0, table_m}));
  press();
  go_to(pixel({0.05, 0.0, table_m}));
  key("Escape");
  go_to(pixel({0.05, 0.05, table_m}));
  release();
  wait(600ms);
  EXPECT_EQ(model_.history().undo_steps(), 0U);
  EXPECT_THAT(done_, IsEmpty());
}

TEST_F(DesktopModelling, FocusThatIsLostLetsGo) {
  move_to(pixel({0.0, 0.0, table_m}));
  press();
  go_to(pixel({0.05, 0.0, table_m}));
  event(FocusLost{});
  frame();
  EXPECT_EQ(done_.size(), 1U);
  release();  // Elsewhere.
  EXPECT_FALSE(desktop_.state().working);
}

TEST_F(DesktopModelling, ThePointSnapsToWhatIsThere) {
  drag_through({{0.0, 0.0, table_m}, {0.04, 0.0, table_m}});
  key("N");
  key("V");
  drag({pixel({0.04, 0.0, table_m}) + glm::dvec2(6.0, 4.0), pixel({0.04, 0.04, table_m})});
  ASSERT_EQ(done_.size(), 2U);
  const v1::Vec3& first = last().add_points().points(0).position();
  EXPECT_NEAR((Vector3d(first.x(), first.y(), first.z()) - Vector3d(0.04, 0, table_m)).norm(), 0.0, 1e-5);
}

TEST_F(DesktopModelling, TheWorkPlaneStepsAndPassesThroughWhatIsUnderThePointer) {
  key("PageUp");
  key("PageUp");
  drag_through({{0.0, 0.0, table_m + 0.01}, {0.03, 0.0, table_m + 0.01}});
  ASSERT_EQ(done_.size(), 1U);
  EXPECT_NEAR(last().add_points().points(0).position().z(), table_m + 0.01, well_below_mm_m);
  for (int i = 0; i < 4; ++i) key("PageDown");
  move_to(pixel({0.01, 0.0, table_m + 0.01}));
  key("C");
  key("N");
  drag_through({{0.0, 0.02, table_m + 0.01}, {0.03, 0.02, table_m + 0.01}});
  EXPECT_NEAR(last().add_points().points(0).position().z(), table_m + 0.01, well_below_mm_m);
}

TEST_F(DesktopModelling, ThePointersPlaceStaysUnderItWhileTheViewTurnsSlidesAndNears) {
  lay_a_sheet();
  const glm::dvec3 place(0.02, 0.015, table_m);
  move_to(pixel(place));
  press(PointerButton::right);
  const glm::dvec2 before = pixel(place);
  move_to(at_px_ + glm::dvec2(90.0, 40.0));
  EXPECT_LT(glm::distance(pixel(place), before), 0.2);
  release(PointerButton::right);

  move_to(pixel(place));
  press(PointerButton::middle);
  move_to(at_px_ + glm::dvec2(-70.0, 30.0));
  EXPECT_LT(glm::distance(pixel(place), at_px_), 0.2);
  release(PointerButton::middle);

  const double near = glm::distance(eye().world_from_eye.position, place);
  event(WheelTurned{3.0});
  EXPECT_LT(glm::distance(pixel(place), at_px_), 0.2);
  EXPECT_LT(glm::distance(eye().world_from_eye.position, place), 0.8 * near);
}

TEST_F(DesktopModelling, NothingIsDoneForAServerThatIsNotThereAndItIsTold) {
  desktop_.set_connection({false, 0});
  drag_through({{0.0, 0.0, table_m}, {0.03, 0.0, table_m}});
  EXPECT_THAT(done_, IsEmpty());
  EXPECT_THAT(desktop_.state().refusal, HasSubstr("not there"));
  key("Enter");
  desktop_.set_connection({true, 9});
  frame();
  wait(200ms);
  EXPECT_THAT(done_, IsEmpty());
  EXPECT_THAT(problems_, IsEmpty());
}

TEST_F(DesktopModelling, PanelsKeepTheirPointerAndTheirKeys) {
  desktop_.set_taken({true, true});
  drag_through({{0.0, 0.0, table_m}, {0.03, 0.0, table_m}});
  key("5");
  EXPECT_THAT(done_, IsEmpty());
  EXPECT_EQ(desktop_.state().tool, DesktopTool::lay);
}

TEST_F(DesktopModelling, WhoOnlyLooksMovesTheCameraAlone) {
  DesktopOptions looking;
  looking.hand = false;
  desktop_ = Desktop(looking);
  desktop_.set_connection({true, 7});
  const double before = camera_.azimuth_rad;
  drag({{600.0, 400.0}, {700.0, 400.0}});
  EXPECT_NE(camera_.azimuth_rad, before);
  key("Delete");
  EXPECT_THAT(problems_, IsEmpty());
}

TEST_F(DesktopModelling, FromNothingToATrimmedShapeWithUndo) {
  lay_a_sheet();
  key("2");
  drag_through({{0.0, 0.015, table_m}, {0.0, 0.015, table_m + 0.02}});
  key("Enter");
  frame();
  const std::size_t steps = model_.history().undo_steps();
  modifiers_.control = true;
  key("Z");
  modifiers_ = {};
  frame();
  EXPECT_EQ(model_.history().undo_steps(), steps - 1);
  modifiers_.control = true;
  key("Y");
  modifiers_ = {};
  frame();
  EXPECT_EQ(model_.history().undo_steps(), steps);
}

}  // namespace
}  // namespace handloft::client::test
