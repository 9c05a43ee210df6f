#include "server-model/store/repair.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace handloft::store {

namespace {

/// Operations a transaction: a file of a million is written in seconds, and none is too large for memory.
constexpr std::size_t records_per_commit = 1000;
constexpr std::size_t bytes_per_commit = 16U << 20U;

Result<std::uint64_t> copy_operations(const OperationLog& from, OperationLog& to) {
  std::vector<LogRecord> records;
  std::size_t bytes = 0;
  const auto write = [&]() -> Status {
    auto status = to.append(records);
    records.clear();
    bytes = 0;
    return status;
  };
  // A record that is not good ends it: what came before it stays.
  std::uint64_t copied = 0;
  Status written;
  (void)from.read(1, [&](LogEntry entry) -> Status {
    bytes += entry.record.operation.size();
    records.push_back(std::move(entry.record));
    ++copied;
    if (records.size() >= records_per_commit || bytes >= bytes_per_commit) written = write();
    return written;
  });
  if (written) written = write();
  if (!written) return written.error();
  return copied;
}

}  // namespace

Result<Repaired> repair(const std::filesystem::path& damaged, const std::filesystem::path& to,
                        const LogOptions& options) {
  auto from = OperationLog::open(damaged, OperationLog::Access::read, options);
  std::optional<Error> unopened;
  if (!from) {
    if (from.error().code != ErrorCode::data_corrupt) return from.error();
    unopened = from.error();
    from = OperationLog::open(damaged, OperationLog::Access::salvage, options);
    if (!from || from->last_sequence() == 0)
      return make_error(ErrorCode::data_corrupt, unopened->message + "; nothing of it can be read");
  }
  LogCheck check = check_log(*from);
  if (unopened) check.damages.insert(check.damages.begin(), {"file", unopened->message});
  // What is appended from now on goes by the present rules, whatever is lost of what was by others.
  LogRules rules = from->rules();
  rules.per_user_from = std::min(rules.per_user_from, check.good_sequence + 1);
  rules.fair_from = std::min(rules.fair_from, check.good_sequence + 1);
  auto log = OperationLog::create(to, from->identity(), options, rules);
  if (!log) return log.error();
  Repaired repaired;
  repaired.damages = std::move(check.damages);
  auto copied = copy_operations(*from, *log);
  if (!copied) return copied.error();
  repaired.operations = *copied;
  if (auto audit = from->audit()) {
    for (const AuditEntry& entry : *audit) {
      if (auto status = log->add_audit(entry); !status) return status.error();
    }
  }
  if (!log->failure()) return log->failure().error();
  return repaired;
}

}  // namespace handloft::store
