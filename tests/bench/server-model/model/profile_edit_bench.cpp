// A19 through the model: a profile edit of 10,000 points <= 5 ms, as one operation and as one more frame of a
// gesture in the air. The bare factorisations are compared with a baseline in bench_geometry.

#include <benchmark/benchmark.h>

#include <cmath>

#include "server-model/model/model.h"

namespace {

namespace v1 = handloft::v1;
using handloft::model::Document;

Document shape(int points, int degree) {
  v1::Operation add;
  auto& request = *add.mutable_add_points();
  request.set_entity("a");
  request.mutable_create();
  for (int i = 0; i < points; ++i) {
    auto& point = *request.add_points();
    const double x = 0.1 * std::sin(0.37 * i);
    const double y = 0.05 * std::cos(0.11 * i);
    point.mutable_position()->set_x(x);
    point.mutable_position()->set_y(y);
    point.mutable_position()->set_z(2 * x * x - y * y + 1e-4 * std::sin(17.0 * i));
    point.set_pressure(0.5 + 0.4 * std::sin(0.05 * i));
  }
  v1::Operation fit;
  fit.mutable_fit()->set_entity("a");
  fit.mutable_fit()->set_degree(static_cast<std::uint32_t>(degree));
  return handloft::model::apply(handloft::model::apply({}, add)->document, fit)->document;
}

v1::Operation profile() {
  v1::Operation operation;
  auto& curve = *operation.mutable_modify_profile()->add_curves();
  for (int i = 0; i < 200; ++i) {
    const double t = -1 + i / 100.0;
    auto& at = *curve.add_points()->mutable_position();
    at.set_x(0.09 * t);
    at.set_y(0.01 * t * t);
    at.set_z(0.04 - 0.02 * t * t);
  }
  return operation;
}

void sizes(benchmark::internal::Benchmark* b) {
  b->ArgNames({"points", "degree"})->Unit(benchmark::kMillisecond);
  for (const int degree : {1, 2, 3, 4, 6}) b->Args({10000, degree});
  b->Args({1000, 2})->Args({100000, 2});
}

void profile_operation(benchmark::State& state) {
  const Document document = shape(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  const v1::Operation operation = profile();
  for (auto _ : state) benchmark::DoNotOptimize(handloft::model::apply(document, operation).ok());
}
BENCHMARK(profile_operation)->Apply(sizes);

// profile_operation is its baseline: the same evaluation with nothing kept from the frame before.
void profile_frame_of_a_gesture(benchmark::State& state) {
  handloft::model::Model model(shape(static_cast<int>(state.range(0)), static_cast<int>(state.range(1))));
  const v1::Operation operation = profile();
  const auto gesture = *model.begin_provisional(operation);
  for (auto _ : state) benchmark::DoNotOptimize(model.update_provisional(gesture, operation).ok());
}
BENCHMARK(profile_frame_of_a_gesture)->Apply(sizes);

}  // namespace
