// What a frame of a gesture, a fit and a hash cost, by the size of the cloud (A27: fit of 1,000 points <= 1
// ms, of 100,000 points <= 20 ms; a gesture's frame must not depend on the size of the cloud).

#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

#include "server-model/model/canonical.h"
#include "server-model/model/model.h"

namespace {

using handloft::model::Document;
namespace v1 = handloft::v1;

v1::Point point_at(int i) {
  v1::Point point;
  const double x = 0.1 * std::sin(0.37 * i);
  const double y = 0.05 * std::cos(0.11 * i);
  point.mutable_position()->set_x(x);
  point.mutable_position()->set_y(y);
  point.mutable_position()->set_z(2 * x * x - y * y + 1e-4 * std::sin(17.0 * i));
  point.set_pressure(0.5 + 0.4 * std::sin(0.05 * i));
  return point;
}

Document cloud(int points) {
  v1::Operation operation;
  auto& request = *operation.mutable_add_points();
  request.set_entity("a");
  request.mutable_create();
  for (int i = 0; i < points; ++i) *request.add_points() = point_at(i);
  return handloft::model::apply({}, operation)->document;
}

void frame_of_a_gesture(benchmark::State& state) {
  handloft::model::Model model(cloud(static_cast<int>(state.range(0))));
  v1::Operation operation;
  operation.mutable_add_points()->set_entity("a");
  const auto gesture = *model.begin_provisional(operation);
  int i = 0;
  for (auto _ : state) {
    const std::vector<v1::Point> one{point_at(++i)};
    benchmark::DoNotOptimize(model.append_provisional(gesture, one).ok());
  }
}
BENCHMARK(frame_of_a_gesture)->Arg(0)->Arg(1'000)->Arg(100'000)->Arg(900'000)->Iterations(10'000);

void fit_of_a_shape(benchmark::State& state) {
  const Document document = cloud(static_cast<int>(state.range(0)));
  v1::Operation operation;
  operation.mutable_fit()->set_entity("a");
  for (auto _ : state) benchmark::DoNotOptimize(handloft::model::apply(document, operation).ok());
}
BENCHMARK(fit_of_a_shape)->Arg(1'000)->Arg(10'000)->Arg(100'000)->Unit(benchmark::kMillisecond);

void hash_of_a_document(benchmark::State& state) {
  const Document document = cloud(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(handloft::model::document_hash(document));
}
BENCHMARK(hash_of_a_document)->Arg(1'000)->Arg(100'000)->Unit(benchmark::kMillisecond);

}  // namespace
