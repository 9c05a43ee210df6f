// The audit trail of a log.

#include <fmt/format.h>

#include "server-model/store/operation_log.h"

namespace handloft::store {

namespace {

std::uint64_t bits(std::int64_t value) {
  return static_cast<std::uint64_t>(value);
}

// Each entry carries the check value of the one before, so that a missing one shows.
Digest check_of(std::string_view before, const AuditEntry& entry) {
  return row_check({before, entry.kind, entry.words}, {bits(entry.time_ns), entry.client_id});
}

Error damaged(std::string message) {
  return make_error(ErrorCode::data_corrupt, std::move(message));
}

}  // namespace

Result<std::vector<AuditEntry>> OperationLog::audit() const {
  Statement rows =
      database_.prepare("SELECT id, time_ns, client_id, kind, words, check_value FROM audit ORDER BY id");
  std::vector<AuditEntry> result;
  std::string before;
  auto step = rows.step();
  for (; step == Statement::Step::row; step = rows.step()) {
    AuditEntry entry{rows.integer(1), rows.number(2), std::string(rows.bytes(3)), std::string(rows.bytes(4))};
    if (rows.bytes(5) != model::as_bytes(check_of(before, entry)))
      return damaged(
          fmt::format("audit entry {} holds other content than its checksum says", rows.integer(0)));
    before = rows.bytes(5);
    result.push_back(std::move(entry));
  }
  if (step == Statement::Step::failed) return database_.error("read the audit trail");
  return result;
}

Status OperationLog::add_audit(const AuditEntry& entry) {
  if (!failure_) return failure_;
  Statement last = database_.prepare("SELECT check_value FROM audit ORDER BY id DESC LIMIT 1");
  const auto step = last.step();
  if (step == Statement::Step::failed) return fail(database_.error("add to the audit trail"));
  const std::string before(step == Statement::Step::row ? last.bytes(0) : std::string_view());
  last.reset();
  Statement row = database_.prepare(
      "INSERT INTO audit (time_ns, client_id, kind, words, check_value) VALUES (?1,?2,?3,?4,?5)");
  const Digest check = check_of(before, entry);
  row.bind(1, entry.time_ns)
      .bind(2, entry.client_id)
      .bind(3, std::string_view(entry.kind))
      .bind(4, std::string_view(entry.words))
      .bind_bytes(5, model::as_bytes(check));
  if (!row.run()) return fail(database_.error("add to the audit trail"));
  return {};
}

}  // namespace handloft::store
