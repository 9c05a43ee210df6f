// Issue 6: a design by mouse and keys alone, from an empty table to a STEP file (V6, A25), with a real window
// on a display of its own, a real model server between, and nobody's glove. What is waited for is what the
// server tells: the hand where the pointer is, points, surfaces, steps of the history.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "client-hmd/desktop/work_plane.h"
#include "client-hmd/mirror/scene_mirror.h"
#include "client-hmd/view/orbit_camera.h"
#include "common/codec/fingertips.h"
#include "common/net/message_client.h"
#include "server-model/exchange/step_reader.h"
#include "tests/support/process.h"
#include "tests/support/test_data.h"
#include "tests/support/x_desktop.h"

namespace handloft::e2e {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;
using client::Entity;
using client::Scene;
using geometry::Vec3;
using test::Pixel;

constexpr double first_plane_m = 0.05;  ///< Of the desktop's work plane.
constexpr double plane_step_m = 0.005;  ///< A press of PageUp.
constexpr auto patience = 60s;          ///< Drawing in software beside everything else takes its time.
constexpr double pixel_m = 0.0007;      ///< At the table; the pointer has no half pixels.

struct Desk {
  int width_px = 960, height_px = 600;
  const char* panels = "never";  ///< --panels
};

class AtADesk : public ::testing::Test {
 protected:
  explicit AtADesk(const Desk& desk = {}) : desk_(desk) {}
  void SetUp() override {
    const std::string model = "unix:" + (folder_.path() / "m.sock").string();
    modeld_ = std::make_unique<test::Process>(
        std::vector<std::string>{test::program("handloft-modeld"), "serve", "--listen", model,
                                 "--export-folder", folder_.path()},
        folder_.path() / "modeld.log");
    ASSERT_TRUE(modeld_->read_line(patience)) << modeld_->error_output();
    x_ = std::make_unique<test::XDesktop>(desk_.width_px, desk_.height_px, folder_.path() / "xvfb.log");
    start_viewer();
    net::ClientOptions options;
    options.role = v1::ROLE_VIEWER;
    auto viewer = net::SyncClient::connect(*net::parse_endpoint(model), options, clock_);
    ASSERT_TRUE(viewer.ok()) << viewer.error().describe();
    viewer_ = std::make_unique<net::SyncClient>(std::move(*viewer));
    v1::Envelope join;
    join.mutable_join();
    ASSERT_TRUE(viewer_->send(join).ok());
    ASSERT_TRUE(x_->focus("Handloft", patience)) << hmd_->error_output();
  }

  void start_viewer() {
    hmd_ = std::make_unique<test::Process>(
        std::vector<std::string>{test::program("handloft-hmd"), "--model",
                                 "unix:" + (folder_.path() / "m.sock").string(), "--size",
                                 std::to_string(desk_.width_px) + "x" + std::to_string(desk_.height_px),
                                 "--name", "desk", "--panels", desk_.panels, "--report",
                                 folder_.path() / "hmd.json", "--screenshot", folder_.path() / "desk.png"},
        folder_.path() / "hmd.log",
        std::vector<std::string>{x_->environment(), "LIBGL_ALWAYS_SOFTWARE=1",
                                 "WAYLAND_DISPLAY=", "XDG_CONFIG_HOME=" + folder_.path().string(),
                                 "XDG_STATE_HOME=" + (folder_.path() / "state").string()});
  }

  void TearDown() override {
    if (hmd_) {
      hmd_->signal(SIGTERM);
      EXPECT_EQ(hmd_->wait(patience), 0) << hmd_->error_output();
    }
    if (modeld_) {
      modeld_->signal(SIGTERM);
      EXPECT_EQ(modeld_->wait(patience), 0) << modeld_->error_output();
    }
    RecordProperty("picture", (folder_.path() / "desk.png").string());
    if (const char* keep = std::getenv("HANDLOFT_KEEP_PICTURES"); keep != nullptr && hmd_) {
      const std::string name = ::testing::UnitTest::GetInstance()->current_test_info()->name();
      std::error_code ignored;
      fs::copy_file(folder_.path() / "desk.png", fs::path(keep) / (name + ".png"),
                    fs::copy_options::overwrite_existing, ignored);
    }
  }

  const Scene& scene() const { return *mirror_.scene(); }
  const Entity* entity(const std::string& id) const {
    const auto found = scene().entities.find(id);
    return found == scene().entities.end() ? nullptr : found->second.get();
  }
  /// Of history that stand. They are the editor's, of which a viewer's scene does not tell (U1): so it asks.
  std::uint32_t steps() {
    EXPECT_TRUE(until([this] { return answered_ == asked_; }));
    return steps_;
  }
  void ask_for_history() {
    v1::Envelope question;
    question.mutable_ask()->set_request(first_history_request + ++asked_);
    question.mutable_ask()->mutable_query()->mutable_history();
    EXPECT_TRUE(viewer_->send(question).ok());
  }

  /// Takes what the server says until `reached`; false when the time is up.
  bool until(const std::function<bool()>& reached) {
    const auto deadline = std::chrono::steady_clock::now() + patience;
    while (!reached()) {
      const auto left =
          std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
      if (left.count() <= 0) return false;
      auto message = viewer_->receive(left);
      if (!message) return false;
      if (message->has_snapshot()) {
        EXPECT_TRUE(mirror_.apply(message->snapshot()).ok());
        ask_for_history();
      } else if (message->has_delta()) {
        EXPECT_TRUE(mirror_.apply(message->delta()).ok());
        ask_for_history();
      } else if (message->has_presence() && message->presence().client_id() != 0) {
        presence_ = message->presence();
      } else if (message->has_answer() && message->answer().result().has_history()) {
        answered_ = message->answer().request() - first_history_request;
        const auto& all = message->answer().result().history().steps();
        steps_ = static_cast<std::uint32_t>(std::count_if(
            all.begin(), all.end(), [](const v1::HistoryStep& step) { return !step.undone(); }));
      } else if (message->has_answer()) {
        answer_ = message->answer();
      }
    }
    return true;
  }
  bool until_steps(std::uint32_t count) {
    return until([&] { return answered_ == asked_ && steps_ >= count && !anything_provisional(); });
  }
  bool anything_provisional() const {
    for (const auto& [id, each] : scene().entities) {
      if (each->provisional) return true;
    }
    return false;
  }
  std::optional<Vec3> hand() const {
    const auto tips = codec::unpack_fingertips(presence_.hand());
    if (!tips) return std::nullopt;
    Vec3 sum = Vec3::Zero();
    for (const codec::FingertipRecord& tip : *tips) {
      if (tip.state != v1::TRACKING_TRACKED) return std::nullopt;
      sum += Vec3(tip.position_m.data());
    }
    return sum / 5.0;
  }

  client::Eye eye() const { return camera_.eye(desk_.width_px, desk_.height_px); }
  Pixel pixel_of(const Vec3& place) const {
    const glm::dvec2 at = *client::seen_at(eye(), {place.x(), place.y(), place.z()});
    return {static_cast<int>(std::lround(at.x)), static_cast<int>(std::lround(at.y))};
  }
  /// Where the pointer's ray meets the level plane of that height.
  Vec3 on_plane(Pixel at, double height_m) const {
    const client::Ray ray = client::ray_through(eye(), {at.x, at.y});
    const glm::dvec3 place = *client::meet(ray, {{0.0, 0.0, height_m}, {0.0, 0.0, 1.0}});
    return {place.x, place.y, place.z};
  }
  /// Goes there and waits until the server has seen the hand come; `off_m`: how far from the level plane's
  /// place it may be, where the cursor lies on something else.
  ::testing::AssertionResult come_to(Pixel at, const Vec3& place, double off_m = 1e-6) {
    x_->move_to(at);
    const bool there = until([&] {
      const auto centre = hand();
      return centre && (*centre - place).norm() <= off_m;
    });
    if (there) return ::testing::AssertionSuccess();
    const auto centre = hand();
    return ::testing::AssertionFailure()
           << "the hand is not at " << place.transpose() << ", but "
           << (centre ? ::testing::PrintToString(Vec3(*centre).transpose()) : "nowhere") << "; doing \""
           << presence_.tool() << "\"\n"
           << hmd_->error_output();
  }
  void draw(const std::vector<Pixel>& path) {
    x_->button(1, true);
    for (std::size_t i = 1; i < path.size(); ++i) x_->glide_to(path[i]);
    x_->button(1, false);
  }
  const v1::QueryResult& ask(const v1::Query& query) {
    v1::Envelope envelope;
    envelope.mutable_ask()->set_request(++request_);
    *envelope.mutable_ask()->mutable_query() = query;
    EXPECT_TRUE(viewer_->send(envelope).ok());
    EXPECT_TRUE(until([&] { return answer_.request() == request_; }));
    return answer_.result();
  }
  /// Where a ray straight down meets something.
  std::optional<Vec3> over(double x, double y) {
    v1::Query query;
    query.mutable_pick()->mutable_origin()->set_x(x);
    query.mutable_pick()->mutable_origin()->set_y(y);
    query.mutable_pick()->mutable_origin()->set_z(0.5);
    query.mutable_pick()->mutable_direction()->set_z(-1.0);
    const v1::QueryResult& result = ask(query);
    if (result.pick().entity().empty()) return std::nullopt;
    const v1::Vec3& at = result.pick().position();
    return Vec3(at.x(), at.y(), at.z());
  }
  void tell(const char* what, double value) {
    RecordProperty(what, std::to_string(value));
    std::printf("%s: %.4f\n", what, value);
  }

  const Desk desk_;
  test::TemporaryDirectory folder_;
  SystemClock clock_;
  std::unique_ptr<test::Process> modeld_, hmd_;
  std::unique_ptr<test::XDesktop> x_;
  std::unique_ptr<net::SyncClient> viewer_;
  client::SceneMirror mirror_;
  v1::Presence presence_;
  v1::Answer answer_;
  static constexpr std::uint64_t first_history_request = 1'000'000;  ///< Apart from those of other questions.
  std::uint64_t asked_ = 0, answered_ = 0;
  std::uint32_t steps_ = 0;
  std::uint64_t request_ = 0;
  client::OrbitCamera camera_;  ///< As the window's.
};

double distance_to_path(const Vec3& at, const std::vector<Vec3>& path) {
  double best = 1e9;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Vec3 way = path[i] - path[i - 1];
    const double t = std::clamp((at - path[i - 1]).dot(way) / way.squaredNorm(), 0.0, 1.0);
    best = std::min(best, (at - path[i - 1] - t * way).norm());
  }
  return best;
}

TEST_F(AtADesk, FromAnEmptyTableToAStepFile_V6_A25) {
  // Three strokes, the middle one 15 mm higher.
  ASSERT_TRUE(until([&] { return scene().epoch != 0; }));
  EXPECT_TRUE(scene().entities.empty());
  std::vector<std::vector<Vec3>> strokes;
  const std::vector<double> rows{-0.035, 0.0, 0.035};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double height = i == 1 ? first_plane_m + 3 * plane_step_m : first_plane_m;
    const std::vector<Pixel> path{pixel_of({-0.06, rows[i], height}), pixel_of({0.06, rows[i], height})};
    for (int k = 1; k <= 3 && i > 0; ++k) {
      // Each press is waited for: GLFW takes two within a millisecond for one.
      x_->type(i == 1 ? "Prior" : "Next");
      const double now = i == 1 ? first_plane_m + k * plane_step_m : first_plane_m + (3 - k) * plane_step_m;
      ASSERT_TRUE(come_to(path[0], on_plane(path[0], now))) << "step " << k << " before stroke " << i;
    }
    ASSERT_TRUE(come_to(path[0], on_plane(path[0], height))) << "before stroke " << i;
    draw(path);
    ASSERT_TRUE(until_steps(static_cast<std::uint32_t>(i + 1))) << presence_.tool();
    strokes.emplace_back();
    for (const Pixel& at : test::XDesktop::way(path[0], path[1]))
      strokes.back().push_back(on_plane(at, height));
  }
  ASSERT_EQ(scene().entities.size(), 1U);
  const Entity& points = *entity("shape-1");
  ASSERT_TRUE(points.points != nullptr);
  EXPECT_GT(points.points->points.size(), 90U);
  double worst_m = 0;
  for (const client::FuzzyPoint& point : points.points->points) {
    const Vec3 at(point.position.x, point.position.y, point.position.z);
    double nearest = 1;
    for (const auto& stroke : strokes) nearest = std::min(nearest, distance_to_path(at, stroke));
    worst_m = std::max(worst_m, nearest);
  }
  tell("points_to_pointer_mm", worst_m * 1e3);
  EXPECT_LT(worst_m, 0.5 * pixel_m);

  // Fitted: the surface passes through the strokes.
  x_->type("Return");
  ASSERT_TRUE(until_steps(4)) << presence_.tool();
  x_->type("b");
  ASSERT_TRUE(
      until([&] { return entity("shape-1")->surface != nullptr && entity("shape-1")->shows_points(); }));
  double fit_m = 0;
  for (const auto& stroke : strokes) {
    const Vec3 middle = 0.5 * (stroke.front() + stroke.back());
    const auto at = over(middle.x(), middle.y());
    ASSERT_TRUE(at);
    fit_m = std::max(fit_m, std::abs(at->z() - middle.z()));
  }
  tell("surface_to_strokes_mm", fit_m * 1e3);
  EXPECT_LT(fit_m, 0.001);

  // Pushed up by 12 mm where the cursor lies on the surface.
  const Vec3 crown = *over(0.0, 0.0);
  x_->type("2");
  const Pixel push_from = pixel_of(crown);
  const Pixel push_to = pixel_of(crown + Vec3(0, 0, 0.012));
  ASSERT_TRUE(come_to(push_from, crown, 0.002));
  const std::uint32_t before_push = steps();
  draw({push_from, push_to});
  ASSERT_TRUE(until_steps(before_push + 1)) << presence_.tool();
  const auto pushed = over(crown.x(), crown.y());
  ASSERT_TRUE(pushed);
  tell("pushed_mm", (pushed->z() - crown.z()) * 1e3);
  EXPECT_GT(pushed->z(), crown.z() + 0.003);

  // A profile in the upright plane through the surface, along x.
  x_->type("3");
  x_->type("p");
  const Vec3 left = *over(-0.045, 0.0);
  const Vec3 right = *over(0.045, 0.0);
  const Vec3 top = Vec3(0.0, 0.0, pushed->z() + 0.01);
  const std::uint32_t before_profile = steps();
  x_->move_to(pixel_of(left));
  draw({pixel_of(left), pixel_of(0.5 * (left + top) + Vec3(0, 0, 0.003)), pixel_of(top),
        pixel_of(0.5 * (right + top) + Vec3(0, 0, 0.003)), pixel_of(right)});
  ASSERT_TRUE(until_steps(before_profile + 1)) << presence_.tool();
  const auto raised = over(0.0, 0.0);
  ASSERT_TRUE(raised);
  tell("profile_raised_mm", (raised->z() - pushed->z()) * 1e3);
  EXPECT_GT(raised->z(), pushed->z() + 0.001);

  // Trimmed to a rounded outline that is drawn on the surface.
  x_->type("9");
  camera_.look(client::StandardView::top);
  x_->type("4");
  std::vector<Pixel> loop;
  for (int i = 0; i <= 24; ++i) {
    const double angle = 2 * M_PI * i / 24;
    const auto at = over(0.035 * std::cos(angle), 0.022 * std::sin(angle));
    ASSERT_TRUE(at) << i;
    loop.push_back(pixel_of(*at));
  }
  const std::uint32_t before_trim = steps();
  x_->move_to(loop.front());
  draw(loop);
  ASSERT_TRUE(until_steps(before_trim + 1)) << presence_.tool();

  // Exported, and read again.
  x_->type("x");
  ASSERT_TRUE(until([&] { return presence_.tool().find(".step") != std::string::npos; })) << presence_.tool();
  std::vector<fs::path> files;
  for (const auto& file : fs::directory_iterator(folder_.path())) {
    if (file.path().extension() == ".step") files.push_back(file.path());
  }
  ASSERT_EQ(files.size(), 1U);
  const auto step = exchange::read_step(files.front());
  ASSERT_TRUE(step.ok()) << step.error().describe();
  EXPECT_TRUE(step->valid);
  ASSERT_EQ(step->faces.size(), 1U);
  const exchange::StepFace& face = step->faces.front();
  EXPECT_TRUE(face.valid);
  // Its border is where the pointer went,
  ASSERT_GT(face.boundary.size(), 20U);
  double border_px = 0;
  for (const Vec3& at : face.boundary) {
    const glm::dvec2 seen = *client::seen_at(eye(), {at.x(), at.y(), at.z()});
    std::vector<Vec3> pointer;
    for (const Pixel& place : loop) pointer.emplace_back(place.x, place.y, 0.0);
    border_px = std::max(border_px, distance_to_path({seen.x, seen.y, 0.0}, pointer));
  }
  tell("border_to_pointer_px", border_px);
  EXPECT_LT(border_px, 3.0);
  // and its surface the one that the server holds.
  double surface_m = 0;
  for (std::size_t i = 0; i < face.samples.size(); i += std::max<std::size_t>(1, face.samples.size() / 12)) {
    const auto at = over(face.samples[i].x(), face.samples[i].y());
    if (at) surface_m = std::max(surface_m, std::abs(at->z() - face.samples[i].z()));
  }
  tell("step_to_surface_mm", surface_m * 1e3);
  EXPECT_LT(surface_m, 1e-4);

  // All of it can be taken back, step by step, by the same keys.
  const std::uint32_t made = steps();
  x_->type_with("Control_L", "z");
  ASSERT_TRUE(until([&] { return answered_ == asked_ && steps_ == made - 1; }));
  x_->type_with("Control_L", "y");
  ASSERT_TRUE(until([&] { return answered_ == asked_ && steps_ == made; }));
}

TEST_F(AtADesk, GoesOnAsTheSameClientAfterACrash_U1) {
  ASSERT_TRUE(until([&] { return scene().epoch != 0; }));
  const auto lay = [&](double y, std::uint32_t steps) {
    const std::vector<Pixel> path{pixel_of({-0.05, y, first_plane_m}), pixel_of({0.05, y, first_plane_m})};
    ASSERT_TRUE(come_to(path[0], on_plane(path[0], first_plane_m)));
    draw(path);
    ASSERT_TRUE(until_steps(steps)) << presence_.tool();
  };
  ASSERT_NO_FATAL_FAILURE(lay(0.0, 1));
  const std::uint64_t client = presence_.client_id();
  hmd_->signal(SIGKILL);
  ASSERT_EQ(hmd_->wait(patience), 128 + SIGKILL);
  presence_.Clear();
  start_viewer();
  ASSERT_TRUE(x_->focus("Handloft", patience)) << hmd_->error_output();
  // Were its operations numbered from the beginning again, this one would be taken for the first one's retry.
  ASSERT_NO_FATAL_FAILURE(lay(0.03, 2));
  EXPECT_EQ(presence_.client_id(), client) << "the key was kept";
  // What was selected is not kept: the second stroke may be a shape of its own.
  std::size_t rows = 0;
  for (const double y : {0.0, 0.03}) {
    rows += std::any_of(scene().entities.begin(), scene().entities.end(), [y](const auto& named) {
      const auto& points = named.second->points->points;
      return std::any_of(points.begin(), points.end(), [y](const client::FuzzyPoint& point) {
        return std::abs(static_cast<double>(point.position.y) - y) < 0.005;
      });
    });
  }
  EXPECT_EQ(rows, 2U) << "both strokes are there";
  // And what it did before its crash it may still take back.
  for (const std::uint32_t left : {1U, 0U}) {
    x_->type_with("Control_L", "z");
    ASSERT_TRUE(until([&] { return answered_ == asked_ && steps_ == left; }));
  }
}

TEST_F(AtADesk, SculptsASheetByAnIconAndPressesFirmly_V6_D19) {
  ASSERT_TRUE(until([&] { return scene().epoch != 0; }));
  // Firmly: the points of a stroke with Shift held are nearly certain.
  const std::vector<Pixel> path{pixel_of({-0.03, -0.02, first_plane_m}),
                                pixel_of({0.03, -0.02, first_plane_m})};
  ASSERT_TRUE(come_to(path[0], on_plane(path[0], first_plane_m)));
  x_->key("Shift_L", true);
  draw(path);
  x_->key("Shift_L", false);
  ASSERT_TRUE(until_steps(1)) << presence_.tool();
  const auto& styles = entity("shape-1")->points->styles;
  ASSERT_FALSE(styles.empty());
  EXPECT_NEAR(styles.front().radius_m, 0.0127 * 0.05, 1e-5);  // A2
  x_->type("Delete");
  ASSERT_TRUE(until([&] { return scene().entities.empty(); }));

  x_->type("w");
  ASSERT_TRUE(until([&] {
    return scene().entities.size() == 1 && scene().entities.begin()->second->surface;
  })) << presence_.tool();
  const Vec3 middle(0.0, 0.0, 0.1);  // InteractionOptions::sheet
  const std::string sheet = scene().entities.begin()->first;
  x_->type("3");
  const Pixel at = pixel_of(middle);
  const Vec3 tapped = on_plane(at, middle.z());
  ASSERT_TRUE(come_to(at, tapped, 0.0005));
  draw({at});
  ASSERT_TRUE(until([&] { return entity(sheet)->icons != nullptr && entity(sheet)->icons->size() == 1; }))
      << presence_.tool();
  const client::Vec3f placed = entity(sheet)->icons->front().place;
  EXPECT_LT((Vec3(placed.x, placed.y, placed.z) - tapped).norm(), 0.0005);

  x_->type("2");
  x_->move_to(at);
  ASSERT_TRUE(until([&] { return entity(sheet)->icons->front().target; })) << presence_.tool();
  const std::uint32_t before = steps();
  draw({at, pixel_of(tapped + Vec3(0, 0, 0.03))});
  ASSERT_TRUE(until_steps(before + 1)) << presence_.tool();
  const client::Vec3f dragged = entity(sheet)->icons->front().place;
  tell("icon_lifted_mm", (static_cast<double>(dragged.z) - middle.z()) * 1e3);
  EXPECT_NEAR(dragged.z, middle.z() + 0.03, 0.001);
  EXPECT_NEAR(dragged.x, tapped.x(), 0.001);
  const auto lifted = over(tapped.x(), tapped.y());
  ASSERT_TRUE(lifted);
  EXPECT_NEAR(lifted->z(), dragged.z, 0.0005);
}

/// As somebody finds it who starts the program for the first time: panels at both sides, and the tour.
class AtADeskWithPanels : public AtADesk {
 protected:
  AtADeskWithPanels() : AtADesk({1440, 900, "windows"}) {}
};

TEST_F(AtADeskWithPanels, WorksBetweenThemAndNotThroughThem_V6_V7) {
  ASSERT_TRUE(until([&] { return scene().epoch != 0; }));
  const std::vector<Pixel> path{pixel_of({-0.05, 0.0, first_plane_m}), pixel_of({0.05, 0.0, first_plane_m})};
  ASSERT_TRUE(come_to(path[0], on_plane(path[0], first_plane_m)));
  draw(path);
  ASSERT_TRUE(until_steps(1)) << presence_.tool();
  const std::size_t laid = entity("shape-1")->points->points.size();
  EXPECT_GT(laid, 10U);

  // Along the left panel: what is pressed there are its buttons, or nothing.
  const Pixel on_panel{30, desk_.height_px / 2};
  x_->move_to(on_panel);
  draw({on_panel, {30, desk_.height_px / 2 + 60}});
  // The next stroke is only told when all before it was.
  ASSERT_TRUE(come_to(path[1], on_plane(path[1], first_plane_m), 0.05));
  draw({path[1], path[0]});
  ASSERT_TRUE(until([&] {
    const Entity* shape = entity("shape-1");
    return shape != nullptr && shape->points->points.size() > laid && !anything_provisional();
  })) << presence_.tool();
  ASSERT_EQ(scene().entities.size(), 1U);
  for (const client::FuzzyPoint& point : entity("shape-1")->points->points) {
    EXPECT_LT(std::abs(point.position.x), 0.06) << "laid beneath a panel";
    EXPECT_NEAR(point.position.z, first_plane_m, 0.01);
  }
}

}  // namespace
}  // namespace handloft::e2e
