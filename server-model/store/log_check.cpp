#include "server-model/store/log_check.h"

#include <fmt/format.h>

#include <optional>
#include <utility>

namespace handloft::store {

namespace {

class Checker {
 public:
  explicit Checker(const OperationLog& log) : log_(log) {}

  LogCheck run() {
    operations();
    if (auto rules = log_.read_rules(); !rules) tell("rules", rules.error().message);
    if (auto audit = log_.audit(); !audit) tell("audit trail", audit.error().message);
    structures();
    mark();
    snapshots();
    return std::move(check_);
  }

 private:
  void tell(std::string where, std::string what) {
    if (check_.damages.size() < LogCheck::max_damages)
      check_.damages.push_back({std::move(where), std::move(what)});
  }

  void operations() {
    auto status = log_.read(1, [&](const LogEntry& entry) -> Status {
      check_.good_sequence = entry.record.sequence;
      return {};
    });
    check_.operations = check_.good_sequence;
    if (!status) tell(fmt::format("operation {}", check_.good_sequence + 1), status.error().message);
    // One whose place has become another is missed at the end by nobody but its row.
    Statement others = log_.database().prepare(
        "SELECT (SELECT count(*) FROM operations WHERE place < ?1) + "
        "(SELECT count(*) FROM operations WHERE place > ?2)");
    others.bind(1, row_place(1)).bind(2, row_place(max_sequence));
    if (others.step() != Statement::Step::row) {
      tell("operations", log_.database().error("count").message);
    } else if (others.integer(0) != 0) {
      tell("operations",
           fmt::format("found {} at places where none can be, expected none", others.integer(0)));
    }
  }

  // Pages, indices and constraints; the index of retries answers who asks again (H3).
  void structures() {
    Statement rows = log_.database().prepare("PRAGMA integrity_check(20)");
    auto step = rows.step();
    for (; step == Statement::Step::row; step = rows.step()) {
      if (rows.bytes(0) != "ok") tell("file", std::string(rows.bytes(0)));
    }
    if (step == Statement::Step::failed) tell("file", log_.database().error("check").message);
  }

  void mark() {
    if (const Status saved = log_.holds_what_was_saved(); !saved) tell("end", saved.error().message);
  }

  void snapshots() {
    auto snapshots = log_.snapshots();
    if (!snapshots) {
      check_.bad_snapshots.push_back({"snapshots", snapshots.error().message});
      return;
    }
    for (const SnapshotRow& snapshot : *snapshots) {
      const auto bad = [&](const Error& error) {
        check_.bad_snapshots.push_back({fmt::format("snapshot at {}", snapshot.sequence), error.message});
      };
      if (auto manifest = log_.manifest(snapshot); !manifest) {
        bad(manifest.error());
        continue;
      }
      Statement rows = log_.database().prepare("SELECT sha256 FROM snapshot_parts WHERE snapshot = ?1");
      rows.bind(1, snapshot.id);
      auto step = rows.step();
      for (; step == Statement::Step::row; step = rows.step()) {
        if (auto part = log_.part(rows.bytes(0)); !part) {
          bad(part.error());
          break;
        }
      }
      if (step == Statement::Step::failed) bad(log_.database().error("read a snapshot"));
    }
  }

  const OperationLog& log_;
  LogCheck check_;
};

}  // namespace

LogCheck check_log(const OperationLog& log) {
  return Checker(log).run();
}

}  // namespace handloft::store
