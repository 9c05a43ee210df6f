// D21 through the model, as a script or a hand has it: n x n control points, bicubic, clamped, made by
// create_sculpt_surface. What an icon costs once (add_icon and its first drag), and a frame of its drag as
// hands drag: one provisional operation that is replaced each frame, then the mesh of what changed. Two
// threads, as the server's pool would. Baseline in the same run: the frame with nothing kept between
// operations (320 x 320). Counters: op_ms and mesh_ms of a frame, add_ms, first_ms; *_cpu_ms the same by the
// time that all threads worked, which other work on the machine does not lengthen.

#include <benchmark/benchmark.h>

#include <google/protobuf/util/json_util.h>
#include <sys/resource.h>
#include <time.h>

#include <chrono>
#include <string>
#include <thread>

#include <fmt/format.h>

#include "server-model/model/model.h"
#include "server-model/model/sculpt_solvers.h"
#include "server-model/stream/sculpt_mesher.h"

namespace handloft::stream {
namespace {

void two_threads(std::size_t count, const std::function<void(std::size_t)>& task) {
  std::thread other([&] {
    for (std::size_t i = 1; i < count; i += 2) task(i);
  });
  for (std::size_t i = 0; i < count; i += 2) task(i);
  other.join();
}

double worked_s() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

class Session {
 public:
  explicit Session(bool kept = true) : model({}, context(kept)) {}

  bool submit(const std::string& json) {
    v1::Operation message;
    if (!google::protobuf::util::JsonStringToMessage(json, &message).ok()) return false;
    auto done = model.submit(message);
    if (!done) error = done.error().describe();
    return done.ok();
  }
  /// The drag of a hand.
  bool begin(const std::string& json) {
    v1::Operation message;
    if (!google::protobuf::util::JsonStringToMessage(json, &message).ok()) return false;
    auto begun = model.begin_provisional(message);
    if (!begun) error = begun.error().describe();
    if (begun) gesture = *begun;
    return begun.ok();
  }
  bool update(const std::string& json) {
    v1::Operation message;
    if (!google::protobuf::util::JsonStringToMessage(json, &message).ok()) return false;
    const Status done = model.update_provisional(gesture, message);
    if (!done) error = done.error().describe();
    return done.ok();
  }
  model::SculptPtr preview() const {
    return model::as_sculpt(model.provisional(gesture)->result().find("s"));
  }

  model::Model model;
  model::ProvisionalId gesture = 0;
  std::string error;

 private:
  static model::ApplyContext context(bool kept) {
    model::ApplyContext made;
    made.parallel = two_threads;
    // With room for nothing, each operation begins anew.
    if (!kept) made.sculpt_solvers = std::make_shared<model::SculptSolvers>(0, 0);
    return made;
  }
};

enum Icon : std::int64_t { point, load, region, curve, inside };

std::string icon_json(std::int64_t kind) {
  switch (kind) {
    case load:
      return R"({"add_icon": {"entity": "s", "id": "i", "role": "ICON_LOAD", "parameters": [{"x": 0.37, "y": 0.61}]}})";
    case region:  // Some sixty by sixty control points of a million.
      return R"({"add_icon": {"entity": "s", "id": "i", "shape": "ICON_REGION",
                 "parameters": [{"x": 0.37, "y": 0.4}, {"x": 0.43, "y": 0.46}]}})";
    case curve:
      return R"({"add_icon": {"entity": "s", "id": "i", "shape": "ICON_CURVE",
                 "parameters": [{"x": 0.3, "y": 0.5}, {"x": 0.5, "y": 0.5}]}})";
    default:
      return R"({"add_icon": {"entity": "s", "id": "i", "parameters": [{"x": 0.37, "y": 0.61}]}})";
  }
}

std::string drag_json(double z) {
  return fmt::format(
      R"({{"drag_icon": {{"entity": "s", "icon": "i", "translation": {{"x": 1e-5, "z": {}}}}}}})", z);
}

void drag(benchmark::State& state) {
  Session session;
  const auto n = state.range(0);
  bool fine = session.submit(fmt::format(
      R"({{"create_sculpt_surface": {{"id": "s", "rectangle": {{"width_m": 1, "depth_m": 1}}, "control_u": {}, "control_v": {}}}}})",
      n, n));
  if (state.range(1) == inside)
    fine = fine &&
           session.submit(R"({"add_icon": {"entity": "s", "id": "o", "shape": "ICON_REGION", "outside": true,
                                      "parameters": [{"x": 0.2, "y": 0.3}, {"x": 0.8, "y": 0.9}]}})");
  auto start = std::chrono::steady_clock::now();
  double worked = worked_s();
  fine = fine && session.submit(icon_json(state.range(1)));
  state.counters["add_ms"] = 1000 * seconds_since(start);
  state.counters["add_cpu_ms"] = 1000 * (worked_s() - worked);
  start = std::chrono::steady_clock::now();
  worked = worked_s();
  fine = fine && session.begin(drag_json(0.01));
  state.counters["first_ms"] = 1000 * seconds_since(start);
  state.counters["first_cpu_ms"] = 1000 * (worked_s() - worked);
  if (!fine) return state.SkipWithError(session.error.c_str());
  SculptMesher mesher = SculptMesher::create(*session.preview(), 1).value();
  double op_s = 0, mesh_s = 0, op_worked_s = 0, mesh_worked_s = 0;
  int frame = 0;
  for (auto _ : state) {
    start = std::chrono::steady_clock::now();
    worked = worked_s();
    fine = fine && session.update(drag_json(++frame % 2 == 0 ? 1e-4 : -1e-4));
    op_s += seconds_since(start);
    op_worked_s += worked_s() - worked;
    start = std::chrono::steady_clock::now();
    worked = worked_s();
    benchmark::DoNotOptimize(mesher.mesh(*session.preview()->surface, two_threads).value());
    mesh_s += seconds_since(start);
    mesh_worked_s += worked_s() - worked;
  }
  if (!fine) return state.SkipWithError(session.error.c_str());
  const double frames = static_cast<double>(state.iterations());
  state.counters["op_ms"] = 1000 * op_s / frames;
  state.counters["mesh_ms"] = 1000 * mesh_s / frames;
  state.counters["op_cpu_ms"] = 1000 * op_worked_s / frames;
  state.counters["mesh_cpu_ms"] = 1000 * mesh_worked_s / frames;
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  state.counters["peak_MiB"] = static_cast<double>(used.ru_maxrss) / 1024;
}
BENCHMARK(drag)
    ->ArgNames({"n", "icon"})
    ->Args({320, point})
    ->Args({320, load})
    ->Args({320, region})
    ->Args({320, curve})
    ->Args({320, inside})
    ->Args({1000, point})
    ->Args({1000, load})
    ->Args({1000, region})
    ->Args({1000, curve})
    ->Args({1000, inside})
    ->Iterations(20)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

void baseline_nothing_kept(benchmark::State& state) {
  Session session(false);
  bool fine =
      session.submit(
          R"({"create_sculpt_surface": {"id": "s", "rectangle": {"width_m": 1, "depth_m": 1}, "control_u": 320, "control_v": 320}})") &&
      session.submit(icon_json(point));
  for (auto _ : state) {
    // Another rest shape each time: what is kept is of no use.
    fine = fine &&
           session.submit(R"({"drag_icon": {"entity": "s", "icon": "i", "translation": {"z": 1e-4}}})") &&
           session.submit(R"({"commit_sculpting": {"entity": "s"}})");
  }
  if (!fine) state.SkipWithError(session.error.c_str());
}
BENCHMARK(baseline_nothing_kept)->Iterations(3)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace handloft::stream
