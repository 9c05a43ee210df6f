#pragma once
// The little of SQLite that the log needs: a connection, prepared statements, transactions, and what went
// wrong in words. One thread uses a connection at a time.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "common/base/result.h"

struct sqlite3;
struct sqlite3_stmt;

namespace handloft::store {

/// Values are bound and read in order. A step that fails leaves its reason in Database::error().
class Statement {
 public:
  Statement() = default;

  Statement& bind(int place, std::int64_t value);
  Statement& bind(int place, std::uint64_t value);  ///< As the same 64 bits.
  Statement& bind(int place, std::string_view text);
  Statement& bind_bytes(int place, std::string_view bytes);  ///< Must live until the step.

  enum class Step { row, done, failed };
  Step step();
  /// To its end, without rows; ready to be used again.
  bool run();
  void reset();

  std::int64_t integer(int column) const;
  std::uint64_t number(int column) const { return static_cast<std::uint64_t>(integer(column)); }
  std::string_view bytes(int column) const;  ///< Also of texts; until the next step.
  bool good() const { return statement_ != nullptr; }

 private:
  friend class Database;
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const;
  };
  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
};

class Database {
 public:
  /// Salvage: reads a file that is shorter than it says as far as it goes.
  enum class Access { read, write, create, salvage };

  /// `vfs`: a registered sqlite3_vfs; empty: the system's. Nothing is written to an existing file by opening
  /// it, nor by closing it before allow_checkpoints().
  static Result<Database> open(const std::filesystem::path& path, Access access, const std::string& vfs);

  Statement prepare(std::string_view sql) const;
  Status execute(const std::string& sql);
  /// The first column of the first row.
  Result<std::int64_t> integer(const std::string& sql) const;
  Status begin() { return execute("BEGIN IMMEDIATE"); }
  /// With synchronous=FULL it returns when the write-ahead log is on the disk. After a failure the
  /// transaction is rolled back.
  Status commit();
  void rollback();
  void allow_checkpoints();
  /// Pages in the write-ahead log since it was last copied into the file, as SQLite told at the last commit.
  int pages_waiting() const { return *pages_waiting_; }
  /// Copies them; harmless when it fails, since the write-ahead log keeps all.
  Status checkpoint();

  /// Whether its file is no longer where it was opened: removed, renamed, or another one.
  bool moved() const;

  /// All of it as it is now, while others write it (SQLite's online backup): `to` is overwritten.
  Status copy_to(Database& to) const;

  /// What SQLite said last: io with its words; resource_exhausted for a full disk; data_corrupt.
  Error error(std::string_view doing) const;

 private:
  struct Close {
    void operator()(sqlite3* connection) const;
  };
  std::unique_ptr<sqlite3, Close> connection_;
  std::unique_ptr<int> pages_waiting_ = std::make_unique<int>(0);
  std::string path_;
};

}  // namespace handloft::store
