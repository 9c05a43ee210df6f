// The log on this machine's disk ($TMPDIR, else /tmp): how long a restart takes (D7), what a durable answer
// costs, and what group commit makes of it. The raw flush of the same bytes is the baseline.

#include <benchmark/benchmark.h>
#include <fcntl.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "proto/operation.pb.h"
#include "server-model/model/canonical.h"
#include "server-model/model/model.h"
#include "server-model/store/group_commit.h"
#include "server-model/store/log_check.h"
#include "server-model/store/operation_log.h"
#include "server-model/store/recovery.h"
#include "server-model/store/snapshot.h"
#include "server-model/store/summary.h"

namespace {

using namespace handloft;
using namespace handloft::store;
namespace fs = std::filesystem;
using Access = OperationLog::Access;

class Folder {
 public:
  Folder() {
    std::string pattern = (fs::temp_directory_path() / "handloft-bench-XXXXXX").string();
    if (::mkdtemp(pattern.data()) == nullptr) std::abort();
    path_ = pattern;
  }
  ~Folder() { fs::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  fs::path file() const { return path_ / "model.handloft"; }

 private:
  fs::path path_;
};

/// A designer's day, over and over: strokes of 20 points on eight shapes, fits, names, undo.
v1::Operation operation_at(std::uint64_t i) {
  v1::Operation operation;
  operation.set_client_id(1 + i % 4);
  operation.set_client_op_id(i + 1);
  const std::string entity = "shape-" + std::to_string(1 + i % 8);
  if (i < 8) {
    operation.mutable_create_dual_shape()->set_id(entity);
  } else if (i % 16 == 15) {
    operation.mutable_undo();
  } else if (i % 4 == 0) {
    operation.mutable_rename()->set_entity(entity);
    operation.mutable_rename()->set_name("name " + std::to_string(i));
  } else if (i % 1000 == 999) {
    operation.mutable_fit()->set_entity(entity);
  } else {
    operation.mutable_add_points()->set_entity(entity);
    for (std::uint64_t k = 0; k < 20; ++k) {
      v1::Point& point = *operation.mutable_add_points()->add_points();
      point.mutable_position()->set_x(1e-4 * static_cast<double>((i * 31 + k) % 2000));
      point.mutable_position()->set_y(1e-4 * static_cast<double>((i * 17 + k * 13) % 2000));
      point.mutable_position()->set_z(1e-5 * static_cast<double>((i + k) % 500));
      point.set_pressure(0.5);
    }
  }
  return operation;
}

/// A log of so many operations with a snapshot `behind` the end. Returns the model's hash.
std::string fill(const fs::path& path, std::uint64_t operations, std::uint64_t behind) {
  auto log = OperationLog::create(path, new_identity(1));
  model::Model model;
  std::vector<LogRecord> batch;
  for (std::uint64_t i = 0; model.sequence() < operations; ++i) {
    const auto submitted = model.submit(operation_at(i));
    if (!submitted || submitted->sequence == 0) continue;
    batch.push_back(make_record(*submitted, 1, static_cast<std::int64_t>(i)));
    if (batch.size() == 1000 || model.sequence() == operations) {
      if (!log->append(batch)) std::abort();
      log->tidy();
      batch.clear();
    }
    if (model.sequence() == operations - behind && !batch.empty()) {
      if (!log->append(batch)) std::abort();
      batch.clear();
    }
    if (model.sequence() == operations - behind) {
      auto snapshot = prepare_snapshot({model.history(), model.sequence()});
      if (!snapshot || !write_snapshot(*log, *std::move(snapshot), 1)) std::abort();
    }
  }
  return model::document_hash(model.document());
}

/// D7: from the file to a model that takes operations. Everything is checked on the way.
void recovery(benchmark::State& state) {
  const Folder folder;
  const auto operations = static_cast<std::uint64_t>(state.range(0));
  const std::string hash = fill(folder.file(), operations, 1000);
  for (auto _ : state) {
    auto log = OperationLog::open(folder.file(), Access::write);
    auto recovered = recover(*log);
    state.PauseTiming();
    if (!recovered || model::document_hash(recovered->model.document()) != hash)
      state.SkipWithError("another model");
    state.counters["replayed"] = static_cast<double>(recovered->replayed);
    state.counters["MB"] = 1e-6 * static_cast<double>(fs::file_size(folder.file()));
    recovered = make_error(ErrorCode::cancelled, "");
    state.ResumeTiming();
  }
}
BENCHMARK(recovery)->Arg(100'000)->Unit(benchmark::kMillisecond)->Iterations(5)->UseRealTime();
void recovery_of_a_million(benchmark::State& state) {
  recovery(state);
}
BENCHMARK(recovery_of_a_million)->Arg(1'000'000)->Unit(benchmark::kMillisecond)->Iterations(1)->UseRealTime();

/// The part of it that reads and checks every record.
void check(benchmark::State& state) {
  const Folder folder;
  fill(folder.file(), 100'000, 1000);
  auto log = OperationLog::open(folder.file(), Access::read);
  for (auto _ : state) {
    const LogCheck found = check_log(*log);
    if (!found.good() || found.operations != 100'000) state.SkipWithError("damaged");
  }
}
BENCHMARK(check)->Unit(benchmark::kMillisecond)->UseRealTime();

/// What a list of models asks of each file (summary.h), with a snapshot 1,000 operations behind the end, and
/// without one.
void list(benchmark::State& state) {
  const Folder folder;
  fill(folder.file(), 100'000, state.range(0) != 0 ? 1000 : 200'000);
  for (auto _ : state) {
    auto log = OperationLog::open(folder.file(), Access::read);
    const auto summary = summarize(*log);
    if (!summary || summary->operations != 100'000 || summary->restored) state.SkipWithError("another list");
  }
}
BENCHMARK(list)->ArgName("snapshot")->Arg(1)->Arg(0)->Unit(benchmark::kMillisecond)->UseRealTime();

/// The baseline: the model restored for it.
void list_by_restoring(benchmark::State& state) {
  const Folder folder;
  fill(folder.file(), 100'000, state.range(0) != 0 ? 1000 : 200'000);
  for (auto _ : state) {
    auto log = OperationLog::open(folder.file(), Access::read);
    if (!recover(*log)) state.SkipWithError("another model");
  }
}
BENCHMARK(list_by_restoring)
    ->ArgName("snapshot")
    ->Arg(1)
    ->Arg(0)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

/// A snapshot of 100,000 operations' model: made beside the model's thread.
void prepare(benchmark::State& state) {
  model::Model model;
  for (std::uint64_t i = 0; model.sequence() < 100'000; ++i) (void)model.submit(operation_at(i));
  for (auto _ : state) {
    const model::StoredState now{model.history(), model.sequence()};
    auto snapshot = prepare_snapshot(now);
    if (!snapshot) state.SkipWithError("none");
    std::size_t bytes = snapshot->manifest.size();
    for (const auto& [hash, content] : snapshot->parts) bytes += content.size();
    state.counters["MB"] = 1e-6 * static_cast<double>(bytes);
  }
}
BENCHMARK(prepare)->Unit(benchmark::kMillisecond)->UseRealTime();

/// What the model's thread pays for it.
void keep_history(benchmark::State& state) {
  model::Model model;
  for (std::uint64_t i = 0; model.sequence() < 20'000; ++i) (void)model.submit(operation_at(i));
  for (auto _ : state) {
    model::KeptState now{model.history().kept(model::EncodeOptions{}.max_steps), model.sequence()};
    benchmark::DoNotOptimize(now);
  }
}
BENCHMARK(keep_history)->Unit(benchmark::kMicrosecond);

/// One durable answer for so many operations: the transaction with its flush.
void append(benchmark::State& state) {
  const Folder folder;
  auto log = OperationLog::create(folder.file(), new_identity(1));
  const auto count = static_cast<std::size_t>(state.range(0));
  std::uint64_t sequence = 0;
  for (auto _ : state) {
    state.PauseTiming();
    std::vector<LogRecord> batch(count);
    for (LogRecord& record : batch) {
      record.sequence = ++sequence;
      record.client_id = 1;
      record.client_op_id = sequence;
      record.operation = operation_at(sequence | 1U).SerializeAsString();
    }
    state.ResumeTiming();
    if (!log->append(batch)) state.SkipWithError("not appended");
    state.PauseTiming();
    log->tidy();
    state.ResumeTiming();
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(sequence));
}
BENCHMARK(append)->Arg(1)->Arg(8)->Arg(64)->Arg(512)->Unit(benchmark::kMicrosecond)->UseRealTime();

/// The baseline: 4 KiB written and flushed, nothing else.
void raw_flush(benchmark::State& state) {
  const Folder folder;
  const int file = ::open(folder.file().c_str(), O_CREAT | O_RDWR, 0600);
  const std::string page(4096, 'x');
  for (auto _ : state) {
    if (::write(file, page.data(), page.size()) != 4096 || ::fdatasync(file) != 0) state.SkipWithError("io");
  }
  ::close(file);
}
BENCHMARK(raw_flush)->Unit(benchmark::kMicrosecond)->UseRealTime();

/// Operations that keep coming while commits are under way: per operation, all durable at the end.
void group_commit(benchmark::State& state) {
  const Folder folder;
  GroupCommit commit(*OperationLog::create(folder.file(), new_identity(1)));
  std::uint64_t sequence = 0;
  for (auto _ : state) {
    while (!commit.accepting()) std::this_thread::yield();
    LogRecord record;
    record.sequence = ++sequence;
    record.client_id = 1;
    record.client_op_id = sequence;
    record.operation = operation_at(sequence | 1U).SerializeAsString();
    commit.append(std::move(record), {});
  }
  commit.flush();
  state.SetItemsProcessed(static_cast<std::int64_t>(sequence));
  state.counters["a_commit"] =
      static_cast<double>(commit.statistics().records) / static_cast<double>(commit.statistics().commits);
}
BENCHMARK(group_commit)->Unit(benchmark::kMicrosecond)->UseRealTime();

}  // namespace
