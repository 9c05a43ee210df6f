// Branches, named versions and the audit trail of a log.

#include <fmt/format.h>

#include <algorithm>

#include "server-model/store/operation_log.h"

namespace handloft::store {

namespace {

std::uint64_t bits(std::int64_t value) {
  return static_cast<std::uint64_t>(value);
}

Digest check_of(const Branch& branch) {
  return row_check({branch.name}, {branch.id, branch.parent, branch.parent_sequence, bits(branch.time_ns)});
}

Digest check_of(const Version& version) {
  return row_check({version.name, version.words},
                   {version.branch, version.sequence, version.client_id, bits(version.time_ns)});
}

// Each entry carries the check value of the one before, so that a missing one shows.
Digest check_of(std::string_view before, const AuditEntry& entry) {
  return row_check({before, entry.kind, entry.words}, {bits(entry.time_ns), entry.client_id});
}

Error damaged(std::string message) {
  return make_error(ErrorCode::data_corrupt, std::move(message));
}

}  // namespace

Result<std::vector<Branch>> OperationLog::branches() const {
  Statement rows = database_.prepare(
      "SELECT id, name, parent, parent_sequence, time_ns, check_value FROM branches ORDER BY id");
  std::vector<Branch> result;
  auto step = rows.step();
  for (; step == Statement::Step::row; step = rows.step()) {
    Branch branch;
    branch.id = rows.number(0);
    branch.name = rows.bytes(1);
    branch.parent = rows.number(2);
    branch.parent_sequence = rows.number(3);
    branch.time_ns = rows.integer(4);
    if (rows.bytes(5) != model::as_bytes(check_of(branch)))
      return damaged(fmt::format("branch {} holds other content than its checksum says", branch.id));
    result.push_back(std::move(branch));
  }
  if (step == Statement::Step::failed) return database_.error("read branches");
  return result;
}

Result<BranchId> OperationLog::add_branch(const std::string& name, BranchId parent,
                                          std::uint64_t parent_sequence, std::int64_t now_ns) {
  if (!failure_) return failure_.error();
  auto all = branches();
  if (!all) return all.error();
  if (std::any_of(all->begin(), all->end(), [&](const Branch& b) { return b.name == name; }))
    return make_error(ErrorCode::already_exists, fmt::format("there is a branch \"{}\" already", name),
                      "name");
  if (parent_sequence > last_sequence(parent)) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected at most {}", parent_sequence, last_sequence(parent)),
                      "parent_sequence");
  }
  auto chain = chain_at(parent, parent_sequence);
  if (!chain) return chain.error();
  const Branch branch{all->back().id + 1, name, parent, parent_sequence, now_ns};
  Statement row = database_.prepare("INSERT INTO branches VALUES (?1,?2,?3,?4,?5,?6)");
  const Digest check = check_of(branch);
  row.bind(1, branch.id)
      .bind(2, std::string_view(branch.name))
      .bind(3, branch.parent)
      .bind(4, branch.parent_sequence)
      .bind(5, branch.time_ns)
      .bind_bytes(6, model::as_bytes(check));
  if (!row.run()) return fail(database_.error("add a branch")).error();
  ends_[branch.id] = {parent_sequence, *chain};
  return branch.id;
}

Result<std::vector<Version>> OperationLog::versions() const {
  Statement rows = database_.prepare(
      "SELECT name, branch, sequence, client_id, time_ns, words, check_value FROM versions ORDER BY time_ns, "
      "name");
  std::vector<Version> result;
  auto step = rows.step();
  for (; step == Statement::Step::row; step = rows.step()) {
    Version version;
    version.name = rows.bytes(0);
    version.branch = rows.number(1);
    version.sequence = rows.number(2);
    version.client_id = rows.number(3);
    version.time_ns = rows.integer(4);
    version.words = rows.bytes(5);
    if (rows.bytes(6) != model::as_bytes(check_of(version)))
      return damaged(fmt::format("version \"{}\" holds other content than its checksum says", version.name));
    result.push_back(std::move(version));
  }
  if (step == Statement::Step::failed) return database_.error("read versions");
  return result;
}

Status OperationLog::add_version(const Version& version) {
  if (!failure_) return failure_;
  if (auto chain = chain_at(version.branch, version.sequence); !chain) return chain.error();
  Statement row = database_.prepare("INSERT INTO versions VALUES (?1,?2,?3,?4,?5,?6,?7)");
  const Digest check = check_of(version);
  row.bind(1, std::string_view(version.name))
      .bind(2, version.branch)
      .bind(3, version.sequence)
      .bind(4, version.client_id)
      .bind(5, version.time_ns)
      .bind(6, std::string_view(version.words))
      .bind_bytes(7, model::as_bytes(check));
  if (row.run()) return {};
  const Error error = database_.error("add a version");
  if (error.code != ErrorCode::already_exists) return fail(error);
  return make_error(error.code, fmt::format("there is a version \"{}\" already", version.name), "name");
}

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
