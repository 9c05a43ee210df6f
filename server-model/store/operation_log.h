#pragma once
// The durable log of one model in one SQLite file (U5): every operation in its place in the total order, with
// what was answered to it (H3), an audit trail, and snapshots from which a restart continues (U3). Named
// versions and alternatives (U6) are what the operations make of the model: the log has no list of its own.
// Each record carries the SHA-256 of itself and the record before, so that a changed, missing or swapped one
// shows.
//
// Durable: append() returns after the write-ahead log has been flushed (WAL, synchronous=FULL). A log that is
// damaged is never opened for writing: see log_check.h for what is said of it, repair.h for what can be had
// of it. One thread uses a log at a time; readers open their own.

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "server-model/model/content_hash.h"
#include "server-model/store/ack_mark.h"
#include "server-model/store/database.h"

namespace handloft::store {

using Digest = model::ContentHash::Digest;
/// One operation as it was applied, with its answer.
struct LogRecord {
  std::uint64_t epoch = 0;
  std::uint64_t sequence = 0;  ///< One more than the record before.
  std::uint64_t client_id = 0;
  std::uint64_t client_op_id = 0;  ///< 0: is never retried. Else unique with client_id.
  std::int64_t time_ns = 0;        ///< Of the wall clock, since 1970.
  std::string operation;           ///< handloft.v1.Operation, the effective one.
  std::string answer;              ///< handloft.v1.StoredAnswer.
};

struct LogEntry {
  LogRecord record;
  Digest chain{};
};

/// Which rules the operations were applied by.
struct LogRules {
  /// From this one on, undo takes back a client's own steps. Of those before nothing is written: they are of
  /// a file of format 1, begun before there were two rules.
  std::uint64_t per_user_from = 1;
  /// From this one on, a history that is full forgets a step of whoever has most (model::UndoRule::per_user);
  /// before, the oldest of all (per_user_oldest_first). Not less than per_user_from.
  std::uint64_t fair_from = 1;
};

/// Who joined, what was refused, which role changed.
struct AuditEntry {
  std::int64_t time_ns = 0;
  std::uint64_t client_id = 0;
  std::string kind;
  std::string words;
};

struct SnapshotRow {
  std::int64_t id = 0;
  std::uint64_t sequence = 0;
  std::string document_hash;  ///< model::document_hash() of what it restores.
  Digest manifest_hash{};
  std::int64_t time_ns = 0;
};

/// Which model this is: the start of the chain, so that records of another one do not fit.
struct LogIdentity {
  std::array<std::uint8_t, 16> model_id{};
  std::int64_t created_ns = 0;
};
LogIdentity new_identity(std::int64_t now_ns);  ///< With a random model_id.

struct LogOptions {
  std::string vfs;  ///< A registered sqlite3_vfs; empty: the system's.
  /// With another vfs there is no file for a mark, and no second process.
  enum class Mark { kept, none };
  Mark mark = Mark::kept;
  /// The write-ahead log is copied into the file at so many pages of 4 KiB: 4 MiB.
  int checkpoint_pages = 1000;
};

class OperationLog {
 public:
  /// Salvage: reads a file that cannot be opened otherwise, one that was cut off say. Its end is then the
  /// last operation before the damage.
  enum class Access { read, write, salvage };

  /// A new, empty one. Errors: already_exists; io.
  static Result<OperationLog> create(const std::filesystem::path& path, const LogIdentity& identity,
                                     const LogOptions& options = {}, const LogRules& rules = {});
  /// Errors: not_found; invalid_argument for a file of another kind; unsupported for one of a newer version;
  /// failed_precondition when another process writes it or its making was never finished. For writing also
  /// data_corrupt: it is checked whole (log_check.h), and the first damage is named. Opening writes nothing.
  static Result<OperationLog> open(const std::filesystem::path& path, Access access,
                                   const LogOptions& options = {});

  const LogIdentity& identity() const { return identity_; }
  /// What a file of an older format does not say begins behind its end, since whoever appends to it appends
  /// by the present rules.
  const LogRules& rules() const { return rules_; }
  const std::filesystem::path& path() const { return path_; }

  // --- operations

  /// All of them or none; durable on return. Errors: io, resource_exhausted (the disk is full): then whether
  /// they are there is known only after opening anew, and the log takes no more (failure()); already_exists
  /// when a client's operation is there already; invalid_argument for a gap in the sequence: then nothing has
  /// happened.
  /// The first append to a file of an older format makes it one of the present, in the same transaction.
  Status append(std::span<const LogRecord> records);
  /// What ended writing.
  const Status& failure() const { return failure_; }
  std::uint64_t last_sequence() const { return end_.sequence; }
  /// Of the first epoch that is not used.
  Result<std::uint64_t> next_epoch() const;
  Result<std::uint64_t> last_client_id() const;

  using Visit = std::function<Status(LogEntry entry)>;
  /// In order from `from`. Each is checked against the one before: data_corrupt names the first that does not
  /// fit. An error of `visit` ends it.
  Status read(std::uint64_t from, const Visit& visit) const;
  /// What was answered to a client's operation; nullopt: not in the log.
  Result<std::optional<LogEntry>> find(std::uint64_t client_id, std::uint64_t client_op_id) const;

  // --- audit

  Status add_audit(const AuditEntry& entry);
  Result<std::vector<AuditEntry>> audit() const;

  // --- snapshots (snapshot.h makes and writes them)

  /// Newest first; only those that were read back and found right.
  Result<std::vector<SnapshotRow>> snapshots() const;
  Result<std::string> manifest(const SnapshotRow& snapshot) const;
  /// Errors: not_found; data_corrupt when its content is not what its name says.
  Result<std::string> part(std::string_view sha256) const;

  /// Copies the write-ahead log into the file when it has grown. Where no answer waits for it.
  void tidy();

  /// For the store's own other files.
  Database& database() { return database_; }
  const Database& database() const { return database_; }
  /// What the file says of its rules. Errors: data_corrupt.
  Result<LogRules> read_rules() const;
  /// Of this record; 0: the start. Errors: not_found; data_corrupt.
  Result<Digest> chain_at(std::uint64_t sequence) const;
  /// Whether all is there that the mark beside the file says was saved: SQLite takes a write-ahead log only
  /// up to its first damage, and says nothing of what came after it. Without a mark nothing is known. Errors:
  /// data_corrupt, with how far it goes.
  Status holds_what_was_saved() const { return holds_what_was_saved(AckMark::read(path_)); }
  /// The same by the mark of another file, of which this one is a copy.
  Status holds_what_was_saved(const std::optional<AckMark::Mark>& mark) const;
  /// Ends writing.
  Status fail(const Error& error);

 private:
  struct End {
    std::uint64_t sequence = 0;
    Digest chain{};
  };
  OperationLog(Database database, std::filesystem::path path, LogOptions options)
      : database_(std::move(database)), path_(std::move(path)), options_(std::move(options)) {}
  Status read_identity();
  Status find_end();
  Status write_format();

  Database database_;
  std::filesystem::path path_;
  LogOptions options_;
  LogIdentity identity_;
  Access access_ = Access::read;
  AckMark mark_;
  End end_;
  LogRules rules_;
  std::int64_t format_ = 0;
  Statement insert_;
  Status failure_;
};

/// The chain before the first record.
Digest chain_start(const LogIdentity& identity);
/// The chain of a record whose predecessor has `before`.
Digest chain_next(const Digest& before, const LogRecord& record);
inline constexpr std::uint64_t max_sequence = (std::uint64_t{1} << 40U) - 1;
/// The key of a row.
std::int64_t row_place(std::uint64_t sequence);
/// Check value of a row of rules or audit.
Digest row_check(std::initializer_list<std::string_view> texts, std::initializer_list<std::uint64_t> numbers);

}  // namespace handloft::store
