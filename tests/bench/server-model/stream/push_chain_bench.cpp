// A15-A17: one frame of a push on 100,000 points with 1,000 contacts, from the tracking frame to the bytes of
// the delta for a viewer, part by part, where session_bench.cpp has the whole with its threads and sockets.
// Medians a frame, in milliseconds of processor time of all threads together, so that others on the machine
// hardly show; `whole_ms` is wall time, and so are updates/s:
//   propagation  the loops that are given to all cores: nearly all of eq. 5 (bench_geometry: two_cores)
//   document     the rest of the interaction's frame: gesture, contacts, farthest pair, points put in place
//   scene        the scene that viewers share
//   pack         what differs from what the viewer has, quantised
//   bytes        that message on the wire
// On two idle cores the whole takes half of propagation and the rest. `range` is in hundredths of d_max.

#include <benchmark/benchmark.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <functional>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "server-model/geometry/push_solver.h"
#include "server-model/interaction/interaction.h"
#include "server-model/stream/scene_builder.h"
#include "server-model/stream/viewer.h"
#include "tests/support/hand_script.h"

namespace handloft {
namespace {

using Eigen::Vector3d;

double process_milliseconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

template <typename T>
T must(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().describe());
  return *std::move(result);
}

/// The dome of push_bench.cpp: 0.4 m x 0.3 m, a millimetre of scatter.
std::vector<Vector3d> dome(std::size_t points) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Vector3d> rest(points);
  for (Vector3d& p : rest) {
    const double x = 0.2 * unit(random), y = 0.15 * unit(random);
    p = {x, y, 0.1 - x * x - 1.5 * y * y + 0.001 * unit(random)};
  }
  return rest;
}

model::Model model_of(const std::vector<Vector3d>& points, model::ApplyContext context) {
  model::Model model({}, std::move(context));
  v1::Operation operation;
  v1::AddPoints& add = *operation.mutable_add_points();
  add.set_entity("dome");
  add.mutable_create();
  std::mt19937_64 random(8);
  for (const Vector3d& p : points) {
    v1::Point& point = *add.add_points();
    point.mutable_position()->set_x(p.x());
    point.mutable_position()->set_y(p.y());
    point.mutable_position()->set_z(p.z());
    point.set_pressure(std::uniform_real_distribution<double>(0.3, 0.9)(random));
  }
  must(model.submit(operation));
  return model;
}

struct Part {
  std::string name;
  std::vector<double> times_ms;
};

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// state.range(0): points, (1): range, (2): cores.
void push_frame(benchmark::State& state) {
  const tbb::global_control cores(tbb::global_control::max_allowed_parallelism,
                                  static_cast<std::size_t>(state.range(2)));
  const auto rest = dome(static_cast<std::size_t>(state.range(0)));
  const double range = static_cast<double>(state.range(1)) / 100;
  double in_parallel_ms = 0;
  model::ApplyContext context;
  context.parallel = [&in_parallel_ms](std::size_t count, const std::function<void(std::size_t)>& task) {
    const double begin = process_milliseconds();
    tbb::parallel_for(std::size_t{0}, count, task);  // As session/parallel.h does it.
    in_parallel_ms += process_milliseconds() - begin;
  };
  model::Model model = model_of(rest, std::move(context));
  interaction::Interaction interaction(model);
  stream::MeshCache meshes([](const std::function<void()>& job) { job(); }, [] {});
  stream::SceneBuilder builder(1, meshes);
  stream::Viewer viewer;
  (void)viewer.next(*builder.build(model, 0));

  test::HandScript script;
  std::vector<geometry::DiskPose> poses;
  // The disk comes down upon the dome by 0.5 mm a frame and then goes on by a hundredth of that, so that the
  // points that it meets stay about the same.
  constexpr double pressure = 0.264;  // A radius of 19.5 mm
  constexpr int frames_down = 120;
  const auto hand_at = [&](int i) {
    const double z = i < frames_down ? 0.13 - 0.0005 * i : 0.07 - 0.000005 * (i - frames_down);
    return script.closed({0.05, 0.02, z}, pressure, range);
  };
  int frame_number = 0;
  const auto on_frame = [&](const v1::TrackingFrame& frame) {
    const auto outcome = interaction.on_frame(frame);
    for (const std::string& problem : outcome.problems) throw std::runtime_error(problem);
    if (const auto disk = interaction.activity(0).disk) poses.push_back(*disk);
    return outcome.scene_changed;
  };
  while (frame_number < frames_down) on_frame(hand_at(frame_number++));
  (void)viewer.next(*builder.build(model, 0, {{interaction.active_shape()}, interaction.targets(), {}}));

  std::vector<Part> parts{{"propagation", {}}, {"document", {}}, {"scene", {}}, {"pack", {}}, {"bytes", {}}};
  std::size_t bytes = 0;
  std::vector<double> whole_ms, cpu_ms;
  for (auto _ : state) {
    const v1::TrackingFrame frame = hand_at(frame_number++);
    in_parallel_ms = 0;
    const auto begin = std::chrono::steady_clock::now();
    std::vector<double> at{process_milliseconds()};
    if (!on_frame(frame)) throw std::runtime_error("the push changed nothing");
    at.push_back(process_milliseconds());
    const auto scene = builder.build(model, 0, {{interaction.active_shape()}, interaction.targets(), {}});
    at.push_back(process_milliseconds());
    const auto delta = viewer.next(*scene);
    if (!delta) throw std::runtime_error("nothing to send");
    at.push_back(process_milliseconds());
    bytes = delta->SerializeAsString().size();
    at.push_back(process_milliseconds());
    const std::chrono::duration<double> whole = std::chrono::steady_clock::now() - begin;
    parts[0].times_ms.push_back(in_parallel_ms);
    parts[1].times_ms.push_back(at[1] - at[0] - in_parallel_ms);
    for (std::size_t i = 2; i < 5; ++i) parts[i].times_ms.push_back(at[i] - at[i - 1]);
    cpu_ms.push_back(at.back() - at.front());
    whole_ms.push_back(1e3 * whole.count());
    state.SetIterationTime(whole.count());
  }
  if (bytes < 14 * rest.size() / 2) throw std::runtime_error("hardly a point has moved");
  for (Part& part : parts) state.counters[part.name + "_ms"] = median(std::move(part.times_ms));
  const double whole = median(std::move(whole_ms));
  state.counters["whole_ms"] = whole;
  state.counters["cpu_ms"] = median(std::move(cpu_ms));
  state.counters["updates/s"] = 1e3 / whole;
  state.counters["delta_kB"] = static_cast<double>(bytes) / 1e3;
  auto solver = must(geometry::PushSolver::create(rest));
  for (const geometry::DiskPose& pose : poses) {
    if (!solver.move_disk(pose)) throw std::runtime_error("the disk's pose was refused");
  }
  state.counters["contacts"] = static_cast<double>(solver.contacts().size());
}
BENCHMARK(push_frame)
    ->ArgNames({"points", "range", "cores"})
    ->ArgsProduct({{100'000}, {10, 25, 50, 75, 100}, {1, 2}})
    ->Args({1'000, 50, 2})
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond)
    ->Iterations(60);

}  // namespace
}  // namespace handloft
