#include "server-model/store/repair.h"

#include <utility>

namespace handloft::store {

namespace {

/// Operations a transaction: a file of a million is written in seconds, and none is too large for memory.
constexpr std::size_t records_per_commit = 1000;
constexpr std::size_t bytes_per_commit = 16U << 20U;

Result<std::uint64_t> copy_operations(const OperationLog& from, OperationLog& to, const Branch& branch) {
  std::vector<LogRecord> records;
  std::size_t bytes = 0;
  const auto write = [&]() -> Status {
    auto status = to.append(records, branch.id);
    records.clear();
    bytes = 0;
    return status;
  };
  // A record that is not good ends it: what came before it stays.
  std::uint64_t copied = 0;
  Status written;
  (void)from.read(
      branch.parent_sequence + 1,
      [&](LogEntry entry) -> Status {
        bytes += entry.record.operation.size();
        records.push_back(std::move(entry.record));
        ++copied;
        if (records.size() >= records_per_commit || bytes >= bytes_per_commit) written = write();
        return written;
      },
      branch.id);
  if (written) written = write();
  if (!written) return written.error();
  return copied;
}

}  // namespace

Result<Repaired> repair(const std::filesystem::path& damaged, const std::filesystem::path& to,
                        const LogOptions& options) {
  auto from = OperationLog::open(damaged, OperationLog::Access::read, options);
  if (!from && from.error().code != ErrorCode::data_corrupt) return from.error();
  if (!from) {
    return make_error(ErrorCode::data_corrupt, from.error().message + "; nothing of it can be read");
  }
  LogCheck check = check_log(*from);
  auto log = OperationLog::create(to, from->identity(), options);
  if (!log) return log.error();
  Repaired repaired;
  repaired.damages = std::move(check.damages);
  auto branches = from->branches();
  if (!branches) branches = std::vector<Branch>{Branch{}};
  for (const Branch& branch : *branches) {
    if (branch.id != main_branch) {
      // One that leaves behind the good part is lost with what it left.
      auto added = log->add_branch(branch.name, branch.parent, branch.parent_sequence, branch.time_ns);
      if (!added) continue;
      if (*added != branch.id) break;
      ++repaired.branches;
    }
    auto copied = copy_operations(*from, *log, branch);
    if (!copied) return copied.error();
    if (branch.id == main_branch) repaired.operations = *copied;
  }
  if (auto versions = from->versions()) {
    for (const Version& version : *versions) {
      if (log->add_version(version)) ++repaired.versions;
    }
  }
  if (auto audit = from->audit()) {
    for (const AuditEntry& entry : *audit) {
      if (auto status = log->add_audit(entry); !status) return status.error();
    }
  }
  if (!log->failure()) return log->failure().error();
  return repaired;
}

}  // namespace handloft::store
