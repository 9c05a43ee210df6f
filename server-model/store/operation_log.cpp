#include "server-model/store/operation_log.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <random>
#include <utility>

#include "server-model/store/log_check.h"
#include "server-model/store/log_schema.h"

namespace handloft::store {

namespace {

constexpr unsigned sequence_bits = 40;

constexpr std::string_view columns =
    "place, epoch, client_id, client_op_id, time_ns, operation, answer, chain";

bool to_digest(std::string_view bytes, Digest& digest) {
  if (bytes.size() != digest.size()) return false;
  std::memcpy(digest.data(), bytes.data(), digest.size());
  return true;
}

LogEntry entry_of(const Statement& row) {
  LogEntry entry;
  entry.record.sequence = row.number(0) & max_sequence;
  entry.record.epoch = row.number(1);
  entry.record.client_id = row.number(2);
  entry.record.client_op_id = row.number(3);
  entry.record.time_ns = row.integer(4);
  entry.record.operation = row.bytes(5);
  entry.record.answer = row.bytes(6);
  if (!to_digest(row.bytes(7), entry.chain)) entry.chain = {};
  return entry;
}

// A new file's name in its folder must be on the disk too.
void flush_folder(const std::filesystem::path& path) {
  const auto folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
  const int handle = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (handle < 0) return;
  ::fsync(handle);
  ::close(handle);
}

Error damaged(std::string message) {
  return make_error(ErrorCode::data_corrupt, std::move(message));
}

/// Of a file that is not there or holds nothing: its mark must not know of operations.
Status nothing_lost(const std::filesystem::path& path, const LogOptions& options) {
  if (options.mark != LogOptions::Mark::kept) return {};
  const auto mark = AckMark::read(path);
  if (!mark || mark->sequence == 0) return {};
  return damaged(fmt::format(
      "{} holds nothing, but {} says that {} operations were on the disk: put a backup back, or remove "
      "the mark to begin anew",
      path.string(), AckMark::path_of(path), mark->sequence));
}

/// SQLite's journal goes by the file's name: under another one what is only in the journal would be missing.
Status one_name(const std::filesystem::path& path) {
  struct stat facts {};
  if (::stat(path.c_str(), &facts) != 0 || facts.st_nlink <= 1) return {};
  return make_error(ErrorCode::failed_precondition,
                    fmt::format("{} has {} names (hard links), expected one: a copy may be written",
                                path.string(), facts.st_nlink));
}

Digest check_of(const LogIdentity& identity, const LogRules& rules) {
  return row_check({{reinterpret_cast<const char*>(identity.model_id.data()), identity.model_id.size()}},
                   {rules.per_user_from, rules.fair_from});
}

/// As files of format 2 have it.
Digest check_of_format_2(const LogIdentity& identity, std::uint64_t per_user_from) {
  return row_check({{reinterpret_cast<const char*>(identity.model_id.data()), identity.model_id.size()}},
                   {per_user_from});
}

std::string rules_row(const LogIdentity& identity, const LogRules& rules) {
  return fmt::format("INSERT INTO rules VALUES (1, {}, {}, x'{}')", rules.per_user_from, rules.fair_from,
                     model::to_hex(model::as_bytes(check_of(identity, rules))));
}

}  // namespace

LogIdentity new_identity(std::int64_t now_ns) {
  LogIdentity identity;
  std::random_device random;
  for (auto& byte : identity.model_id) byte = static_cast<std::uint8_t>(random() & 0xffU);
  identity.created_ns = now_ns;
  return identity;
}

Digest chain_start(const LogIdentity& identity) {
  return model::ContentHash()
      .add("handloft log 1")
      .add({reinterpret_cast<const char*>(identity.model_id.data()), identity.model_id.size()})
      .add(static_cast<std::uint64_t>(identity.created_ns))
      .finish();
}

Digest chain_next(const Digest& before, const LogRecord& record) {
  thread_local model::ContentHash hash;
  return hash.add(model::as_bytes(before))
      .add(only_line)
      .add(record.sequence)
      .add(record.epoch)
      .add(record.client_id)
      .add(record.client_op_id)
      .add(static_cast<std::uint64_t>(record.time_ns))
      .add(std::uint64_t{record.operation.size()})
      .add(record.operation)
      .add(std::uint64_t{record.answer.size()})
      .add(record.answer)
      .finish();
}

std::int64_t row_place(std::uint64_t sequence) {
  return static_cast<std::int64_t>((only_line << sequence_bits) | sequence);
}

Digest row_check(std::initializer_list<std::string_view> texts,
                 std::initializer_list<std::uint64_t> numbers) {
  model::ContentHash hash;
  for (const std::string_view text : texts) hash.add(std::uint64_t{text.size()}).add(text);
  for (const std::uint64_t number : numbers) hash.add(number);
  return hash.finish();
}

Result<OperationLog> OperationLog::create(const std::filesystem::path& path, const LogIdentity& identity,
                                          const LogOptions& options, const LogRules& rules) {
  AckMark mark;
  if (options.mark == LogOptions::Mark::kept) {
    auto locked = AckMark::lock(path);
    if (!locked) return locked.error();
    mark = *std::move(locked);
    std::error_code failed;
    if (!std::filesystem::exists(path, failed)) {
      if (auto known = nothing_lost(path, options); !known) return known.error();
    }
  }
  auto database = Database::open(path, Database::Access::create, options.vfs);
  if (!database) return database.error();
  // A file whose making was cut off holds nothing yet.
  const auto tables = database->integer("SELECT count(*) FROM sqlite_schema");
  if (!tables) return tables.error();
  const auto owner = database->integer("PRAGMA application_id");
  if (!owner) return owner.error();
  if (*tables != 0 || *owner != 0)
    return make_error(ErrorCode::already_exists, fmt::format("{} exists already", path.string()));
  if (auto status = database->execute("PRAGMA journal_mode=WAL"); !status) return status.error();
  if (auto status = database->begin(); !status) return status.error();
  for (const std::string& sql :
       {std::string(schema), fmt::format("PRAGMA application_id={}", application_id),
        std::string(rules_schema), fmt::format("PRAGMA user_version={}", schema_version),
        fmt::format("INSERT INTO model VALUES (1, x'{}', {})",
                    model::to_hex(
                        {reinterpret_cast<const char*>(identity.model_id.data()), identity.model_id.size()}),
                    identity.created_ns),
        rules_row(identity, rules)}) {
    if (auto status = database->execute(sql); !status) {
      database->rollback();
      return status.error();
    }
  }
  if (auto status = database->commit(); !status) return status.error();
  if (auto status = database->checkpoint(); !status) return status.error();
  if (options.mark == LogOptions::Mark::kept) flush_folder(path);
  OperationLog log(*std::move(database), path, options);
  log.access_ = Access::write;
  log.mark_ = std::move(mark);
  if (auto status = log.read_identity(); !status) return status.error();
  if (auto status = log.find_end(); !status) return status.error();
  log.mark_.write({0, chain_start(identity)});
  log.database_.allow_checkpoints();
  return log;
}

Result<OperationLog> OperationLog::open(const std::filesystem::path& path, Access access,
                                        const LogOptions& options) {
  AckMark mark;
  if (options.mark == LogOptions::Mark::kept) {
    std::error_code failed;
    if (!std::filesystem::exists(path, failed))
      return make_error(ErrorCode::not_found, fmt::format("there is no file {}", path.string()));
    if (access == Access::write) {
      if (auto status = one_name(path); !status) return status.error();
      auto locked = AckMark::lock(path);
      if (!locked) return locked.error();
      mark = *std::move(locked);
    }
  }
  const auto way = access == Access::write  ? Database::Access::write
                   : access == Access::read ? Database::Access::read
                                            : Database::Access::salvage;
  auto database = Database::open(path, way, options.vfs);
  if (!database) return database.error();
  OperationLog log(*std::move(database), path, options);
  log.access_ = access;
  log.mark_ = std::move(mark);
  if (auto status = log.read_identity(); !status) return status.error();
  if (access == Access::write) {
    const LogCheck check = check_log(log);
    if (!check.good()) {
      return damaged(
          fmt::format("{} is damaged: {}. It is left as it is; `handloft-modeld repair` writes what is "
                      "good, {} operations, to another file",
                      path.string(), check.damages.front().words(), check.good_sequence));
    }
  }
  if (auto status = log.find_end(); !status) return status.error();
  if (access == Access::write) log.database_.allow_checkpoints();
  return log;
}

Status OperationLog::read_identity() {
  const auto owner = database_.integer("PRAGMA application_id");
  if (!owner) return owner.error();
  const auto tables = database_.integer("SELECT count(*) FROM sqlite_schema");
  if (!tables) return tables.error();
  if (*owner == 0 && *tables == 0) {
    if (auto known = nothing_lost(path_, options_); !known) return known;
    return make_error(
        ErrorCode::failed_precondition,
        fmt::format("{}: the making of this file was never finished; it holds nothing", path_.string()));
  }
  if (*owner != application_id) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("{} is no model: found application id {:#x}, expected {:#x}",
                                  path_.string(), *owner, application_id));
  }
  const auto version = database_.integer("PRAGMA user_version");
  if (!version) return version.error();
  if (*version > schema_version) {
    return make_error(
        ErrorCode::unsupported,
        fmt::format("{} was written by a newer Handloft: found version {}, this one knows up to {}",
                    path_.string(), *version, schema_version));
  }
  if (*version < 1)
    return damaged(fmt::format("{}: found version {}, expected 1 or more", path_.string(), *version));
  format_ = *version;
  Statement row = database_.prepare("SELECT model_id, created_ns FROM model WHERE id = 1");
  if (row.step() != Statement::Step::row || row.bytes(0).size() != identity_.model_id.size())
    return damaged(fmt::format("{}: found no identity of the model", path_.string()));
  std::memcpy(identity_.model_id.data(), row.bytes(0).data(), identity_.model_id.size());
  identity_.created_ns = row.integer(1);
  return {};
}

Status OperationLog::find_end() {
  if (access_ == Access::salvage) {
    // The last row may be in what is lost.
    (void)read(1, [this](const LogEntry& entry) -> Status {
      end_ = {entry.record.sequence, entry.chain};
      return {};
    });
    auto rules = read_rules();
    rules_ = rules ? *rules : LogRules{end_.sequence + 1, end_.sequence + 1};
    return {};
  }
  Statement last = database_.prepare("SELECT max(place) FROM operations WHERE place BETWEEN ?1 AND ?2");
  last.bind(1, row_place(0)).bind(2, row_place(max_sequence));
  if (last.step() != Statement::Step::row) return database_.error("read the end");
  const std::uint64_t sequence = last.number(0) & max_sequence;
  auto chain = chain_at(sequence);
  if (!chain) return chain.error();
  end_ = {sequence, *chain};
  // Of a damaged file that is only read nothing is known: as of format 1.
  auto rules = read_rules();
  if (!rules && access_ == Access::write) return rules.error();
  rules_ = rules ? *rules : LogRules{sequence + 1, sequence + 1};
  return {};
}

Result<LogRules> OperationLog::read_rules() const {
  const std::uint64_t next = end_.sequence + 1;
  if (format_ < rules_since) return LogRules{next, next};
  const bool fair = format_ >= fair_since;
  Statement row = database_.prepare(fair ? "SELECT per_user_from, check_value, fair_from FROM rules"
                                         : "SELECT per_user_from, check_value FROM rules");
  const auto step = row.step();
  if (step == Statement::Step::failed) return database_.error("read the rules");
  if (step == Statement::Step::done) return damaged("found no rules, expected those of undo");
  const LogRules rules{row.number(0), fair ? row.number(2) : next};
  const Digest check = fair ? check_of(identity_, rules) : check_of_format_2(identity_, rules.per_user_from);
  if (row.bytes(1) != model::as_bytes(check))
    return damaged("the rules of undo hold other content than their checksum says");
  return rules;
}

Status OperationLog::holds_what_was_saved(const std::optional<AckMark::Mark>& mark) const {
  if (!mark) return {};
  const auto chain = chain_at(mark->sequence);
  if (!chain) {
    return damaged(fmt::format(
        "operation {} was saved, but found only those up to {}: the write-ahead log ({}-wal) is damaged or "
        "missing, or an older copy of the file was put here (then remove {})",
        mark->sequence, end_.sequence, path_.string(), AckMark::path_of(path_)));
  }
  if (*chain == mark->chain) return {};
  return damaged(fmt::format(
      "operation {} is not the one that was saved there: found checksum {:.16}, expected {:.16}",
      mark->sequence, model::to_hex(model::as_bytes(*chain)), model::to_hex(model::as_bytes(mark->chain))));
}

Status OperationLog::write_format() {
  for (const std::string& sql :
       {std::string("DROP TABLE IF EXISTS rules"), std::string(rules_schema), rules_row(identity_, rules_),
        fmt::format("PRAGMA user_version={}", schema_version)}) {
    if (auto status = database_.execute(sql); !status) return status;
  }
  return {};
}

Result<Digest> OperationLog::chain_at(std::uint64_t sequence) const {
  if (sequence == 0) return chain_start(identity_);
  Statement row = database_.prepare("SELECT chain FROM operations WHERE place = ?1");
  row.bind(1, row_place(std::min(sequence, max_sequence)));
  const auto step = row.step();
  if (step == Statement::Step::failed) return database_.error("read a checksum");
  if (step == Statement::Step::done)
    return make_error(ErrorCode::not_found, fmt::format("there is no operation {}", sequence));
  Digest digest{};
  if (!to_digest(row.bytes(0), digest)) return damaged(fmt::format("operation {} has no checksum", sequence));
  return digest;
}

Status OperationLog::fail(const Error& error) {
  if (failure_) failure_ = error;
  return error;
}

Status OperationLog::append(std::span<const LogRecord> records) {
  if (!failure_) return failure_;
  if (access_ != Access::write)
    return make_error(ErrorCode::failed_precondition, fmt::format("{} is open for reading", path_.string()));
  if (records.empty()) return {};
  End now = end_;
  for (const LogRecord& record : records) {
    if (record.sequence != now.sequence + 1 || record.sequence > max_sequence) {
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found {}, expected {}", record.sequence, now.sequence + 1), "sequence");
    }
    ++now.sequence;
  }
  if (database_.moved())
    return fail(make_error(ErrorCode::io,
                           fmt::format("{} was removed or moved while it was being written: nothing more is "
                                       "saved",
                                       path_.string())));
  if (auto status = database_.begin(); !status) return fail(status.error());
  if (format_ < schema_version) {
    if (auto status = write_format(); !status) {
      database_.rollback();
      return fail(status.error());
    }
  }
  if (!insert_.good())
    insert_ = database_.prepare(
        fmt::format("INSERT INTO operations ({}) VALUES (?1,?2,?3,?4,?5,?6,?7,?8)", columns));
  for (const LogRecord& record : records) {
    now.chain = chain_next(now.chain, record);
    insert_.bind(1, row_place(record.sequence))
        .bind(2, record.epoch)
        .bind(3, record.client_id)
        .bind(4, record.client_op_id)
        .bind(5, record.time_ns)
        .bind_bytes(6, record.operation)
        .bind_bytes(7, record.answer)
        .bind_bytes(8, model::as_bytes(now.chain));
    if (insert_.step() != Statement::Step::done) {
      const Error error = database_.error("append an operation");
      insert_.reset();
      database_.rollback();
      if (error.code != ErrorCode::already_exists) return fail(error);
      return make_error(ErrorCode::already_exists,
                        fmt::format("operation {} of client {} is in the log already", record.client_op_id,
                                    record.client_id),
                        "client_op_id");
    }
    insert_.reset();
  }
  if (auto status = database_.commit(); !status) return fail(status.error());
  end_ = now;
  format_ = std::max(format_, schema_version);
  mark_.write({now.sequence, now.chain});
  return {};
}

Result<std::uint64_t> OperationLog::next_epoch() const {
  auto last = database_.integer("SELECT coalesce(max(epoch), 0) FROM operations");
  if (!last) return last.error();
  return static_cast<std::uint64_t>(*last) + 1;
}

Result<std::uint64_t> OperationLog::last_client_id() const {
  auto last = database_.integer("SELECT coalesce(max(client_id), 0) FROM operations");
  if (!last) return last.error();
  return static_cast<std::uint64_t>(*last);
}

Status OperationLog::read(std::uint64_t from, const Visit& visit) const {
  std::uint64_t expected = std::max<std::uint64_t>(from, 1);
  auto start = chain_at(expected - 1);
  if (!start) return start.error();
  Digest chain = *start;
  Statement rows = database_.prepare(
      fmt::format("SELECT {} FROM operations WHERE place BETWEEN ?1 AND ?2 ORDER BY place", columns));
  rows.bind(1, row_place(std::min(expected, max_sequence))).bind(2, row_place(max_sequence));
  auto step = rows.step();
  for (; step == Statement::Step::row; step = rows.step()) {
    LogEntry entry = entry_of(rows);
    if (entry.record.sequence != expected) {
      return make_error(ErrorCode::data_corrupt,
                        fmt::format("found operation {} after {}, expected {}", entry.record.sequence,
                                    expected - 1, expected),
                        "sequence");
    }
    chain = chain_next(chain, entry.record);
    if (entry.chain != chain) {
      return make_error(
          ErrorCode::data_corrupt,
          fmt::format("found checksum {:.16}, expected {:.16}", model::to_hex(model::as_bytes(entry.chain)),
                      model::to_hex(model::as_bytes(chain))),
          fmt::format("operation {}", expected));
    }
    if (auto status = visit(std::move(entry)); !status) return status;
    ++expected;
  }
  if (step == Statement::Step::failed) return database_.error(fmt::format("read operation {}", expected));
  return {};
}

Result<std::optional<LogEntry>> OperationLog::find(std::uint64_t client_id,
                                                   std::uint64_t client_op_id) const {
  Statement row = database_.prepare(fmt::format(
      "SELECT {} FROM operations WHERE client_id = ?1 AND client_op_id = ?2 AND client_op_id <> 0", columns));
  row.bind(1, client_id).bind(2, client_op_id);
  const auto step = row.step();
  if (step == Statement::Step::failed) return database_.error("find an operation");
  if (step == Statement::Step::done) return std::optional<LogEntry>();
  return std::optional(entry_of(row));
}

Result<std::string> OperationLog::part(std::string_view sha256) const {
  Statement row = database_.prepare("SELECT content FROM parts WHERE sha256 = ?1");
  row.bind_bytes(1, sha256);
  const auto step = row.step();
  if (step == Statement::Step::failed) return database_.error("read a part");
  if (step == Statement::Step::done)
    return make_error(ErrorCode::not_found, fmt::format("there is no part {:.16}", model::to_hex(sha256)));
  std::string content(row.bytes(0));
  if (model::as_bytes(model::content_hash(content)) != sha256)
    return damaged(fmt::format("part {:.16} holds other content than its name says", model::to_hex(sha256)));
  return content;
}

Result<std::string> OperationLog::manifest(const SnapshotRow& snapshot) const {
  Statement row = database_.prepare("SELECT manifest FROM snapshots WHERE id = ?1");
  row.bind(1, snapshot.id);
  if (row.step() != Statement::Step::row) return database_.error("read a snapshot");
  std::string content(row.bytes(0));
  if (model::content_hash(content) != snapshot.manifest_hash)
    return damaged(
        fmt::format("the snapshot at {} holds other content than its checksum says", snapshot.sequence));
  return content;
}

Result<std::vector<SnapshotRow>> OperationLog::snapshots() const {
  Statement rows = database_.prepare(
      "SELECT id, sequence, document_hash, manifest_hash, time_ns FROM snapshots WHERE verified = 1 "
      "ORDER BY id DESC");
  std::vector<SnapshotRow> result;
  auto step = rows.step();
  for (; step == Statement::Step::row; step = rows.step()) {
    SnapshotRow& row = result.emplace_back();
    row.id = rows.integer(0);
    row.sequence = rows.number(1);
    row.document_hash = rows.bytes(2);
    to_digest(rows.bytes(3), row.manifest_hash);
    row.time_ns = rows.integer(4);
  }
  if (step == Statement::Step::failed) return database_.error("read snapshots");
  return result;
}

void OperationLog::tidy() {
  if (failure_ && database_.pages_waiting() >= options_.checkpoint_pages) {
    // Nothing is lost when it fails: all is in the write-ahead log. But the disk is not well.
    if (auto status = database_.checkpoint(); !status) (void)fail(status.error());
  }
}

}  // namespace handloft::store
