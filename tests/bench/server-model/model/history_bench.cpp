// What a step of history costs by the number of steps that there are and of users who have made them (U1):
// making one, taking it back and doing it again, with room and where one is forgotten for each that is made,
// telling what undo would answer, and what the model's thread pays for a snapshot. The baseline is the
// history without steps. Each user renames an entity of their own; that a document has more of them costs by
// itself (delta_between), so compare numbers of steps for the same number of users.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "proto/operation.pb.h"
#include "server-model/model/document.h"
#include "server-model/model/history.h"

namespace {

using namespace handloft::model;
namespace v1 = handloft::v1;

constexpr std::size_t room = 20'000;

std::string entity_of(std::uint64_t client) {
  return "seat-" + std::to_string(client);
}

Document with_entities(std::uint64_t users) {
  Document document;
  for (std::uint64_t client = 0; client < users; ++client) {
    v1::Operation operation;
    operation.mutable_create_dual_shape()->set_id(entity_of(client));
    auto applied = apply(document, operation);
    if (!applied) std::abort();
    document = applied->document;
  }
  return document;
}

/// Two names in turn: what is made is the same for each number of steps.
Document renamed(const Document& before, std::uint64_t client, std::uint64_t i) {
  v1::Operation operation;
  operation.mutable_rename()->set_entity(entity_of(client));
  operation.mutable_rename()->set_name(i % 2 == 0 ? "even" : "odd");
  auto applied = apply(before, operation);
  if (!applied) std::abort();
  return applied->document;
}

StepInfo by(std::uint64_t client) {
  StepInfo info;
  info.words = "Rename";
  info.client_id = client;
  return info;
}

/// So many steps of all, in turn; client 0 makes the last one.
History filled(std::uint64_t steps, std::uint64_t users, std::size_t most) {
  History history(with_entities(users), most);
  for (std::uint64_t i = steps; i > 0; --i) {
    const std::uint64_t client = (i - 1) % users;
    history.push(renamed(history.current(), client, (i - 1) / users), by(client));
  }
  return history;
}

void steps_and_users(benchmark::internal::Benchmark* bench) {
  bench->ArgNames({"steps", "users"});
  for (const int users : {1, 20, 200}) {
    for (const int steps : {0, 10, 1000, 10'000}) bench->Args({steps, users});
  }
}

std::uint64_t arg(const benchmark::State& state, std::size_t i) {
  return static_cast<std::uint64_t>(state.range(i));
}

/// A new step, then taken back, which the next one forgets: as many steps each time.
void push_and_undo(benchmark::State& state) {
  History history = filled(arg(state, 0), arg(state, 1), room);
  const Document before = history.current();
  const Document after = renamed(before, 0, 1), other = renamed(before, 0, 0);
  const Document& next = difference(before, after).empty() ? other : after;
  for (auto _ : state) {
    history.push(next, by(0));
    if (!history.undo(0)) state.SkipWithError("refused");
  }
}
BENCHMARK(push_and_undo)->Apply(steps_and_users);

void undo_and_redo(benchmark::State& state) {
  History history = filled(arg(state, 0), arg(state, 1), room);
  history.push(renamed(history.current(), 0, 1), by(0));
  for (auto _ : state) {
    if (!history.undo(0) || !history.redo(0)) state.SkipWithError("refused");
  }
}
BENCHMARK(undo_and_redo)->Apply(steps_and_users);

/// The history is full: each step that is made forgets one of whoever has most.
void push_and_forget(benchmark::State& state) {
  const std::uint64_t steps = arg(state, 0);
  History history = filled(steps, arg(state, 1), std::max<std::uint64_t>(1, steps));
  const Document even = renamed(history.current(), 0, 0), odd = renamed(even, 0, 1);
  std::uint64_t i = 0;
  for (auto _ : state) history.push(i++ % 2 == 0 ? odd : even, by(0));
}
BENCHMARK(push_and_forget)->Apply(steps_and_users);

/// What each viewer is told after each operation.
void tell(benchmark::State& state) {
  const History history = filled(arg(state, 0), arg(state, 1), room);
  for (auto _ : state) {
    std::string refused = history.undo_refused(0);
    benchmark::DoNotOptimize(refused);
  }
}
BENCHMARK(tell)->Apply(steps_and_users);

/// For a snapshot of 1,000 steps, against a copy of all of it.
void keep(benchmark::State& state) {
  const History history = filled(arg(state, 0), arg(state, 1), room);
  for (auto _ : state) {
    History::Kept kept = history.kept(1000);
    benchmark::DoNotOptimize(kept);
  }
}
BENCHMARK(keep)->Apply(steps_and_users)->Unit(benchmark::kMicrosecond);

void copy(benchmark::State& state) {
  const History history = filled(arg(state, 0), arg(state, 1), room);
  for (auto _ : state) {
    History all = history;
    benchmark::DoNotOptimize(all);
  }
}
BENCHMARK(copy)->Apply(steps_and_users)->Unit(benchmark::kMicrosecond);

}  // namespace
