// Scenes as heavy as the mirror lets in, in the real program on a software renderer (V3, V5, F2): frames go
// on and the program ends as it should; and where a frame does not end, the program does.

#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <functional>
#include <future>
#include <nlohmann/json.hpp>
#include <ostream>

#include "client-hmd/render/image.h"
#include "tests/integration/client-hmd/hostile_attacks.h"
#include "tests/support/eventually.h"
#include "tests/support/process.h"
#include "tests/support/test_data.h"
#include "tests/unit/client-hmd/mirror/scene_messages.h"

namespace handloft::client {
namespace {

using handloft::test::HostileConnection;
using handloft::test::HostileServer;
using std::chrono::seconds;

/// A change of an entity that is not there yet.
v1::Envelope new_entity(const std::string& id, v1::Representation representation) {
  v1::Envelope envelope;
  *envelope.mutable_delta() = test::delta();
  v1::EntityState& state = *envelope.mutable_delta()->mutable_changed(0);
  state.Clear();
  state.set_id(id);
  state.set_revision(1);
  state.set_representation(representation);
  return envelope;
}

/// All points at one place.
v1::PointCloud heap(std::uint32_t points, float radius_m) {
  codec::PointTail tail;
  tail.total = points;
  codec::FuzzyStyle style;
  style.pressure = 0.5;
  style.radius_m = radius_m;
  style.shell_radius_m = {radius_m, 0.8F * radius_m, 0.6F * radius_m, 0.4F * radius_m, 0.2F * radius_m};
  style.shell_alpha = {0.05F, 0.10F, 0.12F, 0.15F, 0.20F};
  tail.palette = {style};
  tail.positions.assign(points, {0.0, 0.0, 0.05});
  tail.styles.assign(points, 0);
  return *codec::encode_points(tail);
}

/// One triangle, two metres wide and nowhere opaque, `times` times.
v1::Mesh one_over_the_other(int times) {
  codec::MeshData mesh;
  mesh.positions = {{-1, -1, 0.02F}, {1, -1, 0.02F}, {0, 1, 0.02F}};
  mesh.normals.assign(3, {0, 0, 1});
  mesh.opacity.assign(3, 128);
  for (int i = 0; i < times; ++i) mesh.indices.insert(mesh.indices.end(), {0, 1, 2});
  return *codec::encode_mesh(mesh);
}

/// The program before a server that sends the good scene and `more`.
class Watched {
 public:
  explicit Watched(const std::function<bool(HostileConnection&)>& more)
      : endpoint_(*net::parse_endpoint("unix:" + (folder_.path() / "s.sock").string())),
        server_(endpoint_,
                [this, more](HostileConnection& client) {
                  if (!test::serve_good_scene(client) || !more(client) || !client.survives()) return;
                  sent_.set_value();
                  client.hold();
                }),
        hmd_({handloft::test::program("handloft-hmd"), "--model", endpoint_.to_string(), "--offscreen",
              "--size", "320x240", "--frame-rate", "30", "--screenshot", picture(), "--report", report_file(),
              "--log-level", "debug"},
             folder_.path() / "hmd.log") {}

  /// Waits until it has received everything and is drawing a scene of as many entities.
  bool draws(std::size_t entities) {
    const std::string line = "shows " + std::to_string(entities) + " entities from now on";
    return sent_.get_future().wait_for(seconds(120)) == std::future_status::ready &&
           handloft::test::eventually([&] { return hmd_.error_output().find(line) != std::string::npos; },
                                      seconds(60));
  }
  handloft::test::Process& program() { return hmd_; }
  std::filesystem::path picture() const { return folder_.path() / "end.png"; }
  nlohmann::json report() const {
    std::ifstream in(report_file());
    return nlohmann::json::parse(in, nullptr, false);
  }

 private:
  std::filesystem::path report_file() const { return folder_.path() / "report.json"; }

  const handloft::test::TemporaryDirectory folder_;
  const net::Endpoint endpoint_;
  std::promise<void> sent_;
  HostileServer server_;
  handloft::test::Process hmd_;
};

struct Heap {
  const char* name;
  int clouds;
  std::uint32_t points;  ///< Of each.
  float radius_m;
};
void PrintTo(const Heap& heap, std::ostream* out) {
  *out << heap.name;
}

class HeavyPoints : public testing::TestWithParam<Heap> {};

TEST_P(HeavyPoints, AreDrawnAndLetTheProgramEnd_V3) {
  const Heap& all = GetParam();
  Watched watched([&all](HostileConnection& client) {
    for (int i = 0; i < all.clouds; ++i) {
      v1::Envelope cloud = new_entity("heap " + std::to_string(i), v1::REPRESENTATION_POINTS);
      *cloud.mutable_delta()->mutable_changed(0)->mutable_points() = heap(all.points, all.radius_m);
      if (!client.send(cloud)) return false;
    }
    return true;
  });
  ASSERT_TRUE(watched.draws(1 + static_cast<std::size_t>(all.clouds))) << watched.program().error_output();
  watched.program().signal(SIGTERM);
  // Without bounds the first two of these took minutes, a frame as long as the picture.
  ASSERT_EQ(watched.program().wait(seconds(60)), 0) << watched.program().error_output();
  const nlohmann::json report = watched.report();
  ASSERT_FALSE(report.is_discarded());
  EXPECT_EQ(report["scene"]["points"].get<std::size_t>(),
            test::good_points + static_cast<std::size_t>(all.clouds) * all.points);
  const Result<Image> picture = read_png(watched.picture());
  ASSERT_TRUE(picture.ok()) << picture.error().describe();
  std::printf("%s: longest frame %.0f ms\n", all.name, report["frame_ms"]["longest"].get<double>());
}

INSTANTIATE_TEST_SUITE_P(AtOnePlace, HeavyPoints,
                         testing::Values(Heap{"InManySmallClouds", 400, 19'999, 0.0127F},
                                         Heap{"InLargeCloudsOfLargeDiscs", 8, 1'000'000, 1.0F},
                                         Heap{"AsLargeDiscs", 1, 19'999, 1.0F}),
                         [](const auto& parameters) { return std::string(parameters.param.name); });

/// A million triangles over each other take a software renderer minutes.
bool send_an_endless_frame(HostileConnection& client) {
  v1::Envelope surface = new_entity("pile", v1::REPRESENTATION_SURFACE);
  v1::EntityState& state = *surface.mutable_delta()->mutable_changed(0);
  state.set_surface_shown(true);
  *state.mutable_surface() = one_over_the_other(1'000'000);
  return client.send(surface);
}

TEST(HeavyFrame, EndsWithTheProgramWhenItIsToldASecondTime_V5) {
  Watched watched(send_an_endless_frame);
  ASSERT_TRUE(watched.draws(2)) << watched.program().error_output();
  watched.program().signal(SIGTERM);
  watched.program().signal(SIGINT);
  ASSERT_EQ(watched.program().wait(seconds(60)), 1) << watched.program().error_output();
  EXPECT_NE(watched.program().error_output().find("told to end a second time"), std::string::npos)
      << watched.program().error_output();
}

TEST(HeavyFrame, KeepsNoProgramFromEnding_V5) {
  Watched watched(send_an_endless_frame);
  ASSERT_TRUE(watched.draws(2)) << watched.program().error_output();
  watched.program().signal(SIGTERM);
  const std::optional<int> status = watched.program().wait(seconds(90));
  ASSERT_TRUE(status) << watched.program().error_output();
  if (*status == 0) GTEST_SKIP() << "a graphics card drew a million triangles over each other meanwhile";
  EXPECT_EQ(*status, 1);
  EXPECT_NE(watched.program().error_output().find("a frame did not end within 10 s"), std::string::npos)
      << watched.program().error_output();
}

}  // namespace
}  // namespace handloft::client
