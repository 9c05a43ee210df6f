#include "server-model/store/database.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sqlite3.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

namespace handloft::store {

namespace {
constexpr int busy_timeout_ms = 5'000;  // A reader's moment; writers are kept apart by AckMark.
}

void Statement::Finalize::operator()(sqlite3_stmt* statement) const {
  sqlite3_finalize(statement);
}

Statement& Statement::bind(int place, std::int64_t value) {
  sqlite3_bind_int64(statement_.get(), place, value);
  return *this;
}

Statement& Statement::bind(int place, std::uint64_t value) {
  return bind(place, static_cast<std::int64_t>(value));
}

Statement& Statement::bind(int place, std::string_view text) {
  sqlite3_bind_text64(statement_.get(), place, text.data(), text.size(), SQLITE_TRANSIENT, SQLITE_UTF8);
  return *this;
}

Statement& Statement::bind_bytes(int place, std::string_view bytes) {
  sqlite3_bind_blob64(statement_.get(), place, bytes.data() == nullptr ? "" : bytes.data(), bytes.size(),
                      SQLITE_STATIC);
  return *this;
}

Statement::Step Statement::step() {
  if (!statement_) return Step::failed;
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_ROW) return Step::row;
  return code == SQLITE_DONE ? Step::done : Step::failed;
}

bool Statement::run() {
  const bool done = step() == Step::done;
  reset();
  return done;
}

void Statement::reset() {
  if (!statement_) return;  // A table that a damaged file lacks.
  sqlite3_reset(statement_.get());
  sqlite3_clear_bindings(statement_.get());
}

std::int64_t Statement::integer(int column) const {
  return sqlite3_column_int64(statement_.get(), column);
}

std::string_view Statement::bytes(int column) const {
  const auto* data = static_cast<const char*>(sqlite3_column_blob(statement_.get(), column));
  const int size = sqlite3_column_bytes(statement_.get(), column);
  return data == nullptr ? std::string_view() : std::string_view(data, static_cast<std::size_t>(size));
}

void Database::Close::operator()(sqlite3* connection) const {
  sqlite3_close_v2(connection);
}

namespace {

/// SQLite makes a file beside one that is only read, too. Where it may not, as on a medium that is read-only,
/// a file whose write-ahead log holds nothing can be read without: then nobody can be writing it there.
bool cannot_change(const std::filesystem::path& path) {
  const auto folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
  std::error_code missing;
  const auto waiting = std::filesystem::file_size(path.string() + "-wal", missing);
  return ::access(folder.c_str(), W_OK) != 0 && (missing || waiting == 0) &&
         !std::filesystem::exists(path.string() + "-shm", missing);
}

/// Roles are checked by the server; whoever may read the file needs none. SQLite gives what it puts beside a
/// file the same mode. Whatever goes wrong is told when it is opened.
void keep_private(const std::filesystem::path& path) {
  constexpr mode_t owner_only = 0600;
  const int file = ::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, owner_only);
  if (file >= 0) ::close(file);
}

std::string as_uri(const std::string& path) {
  std::string uri = "file:";
  for (const char c : path) {
    if (c == '%' || c == '?' || c == '#') {
      uri += fmt::format("%{:02x}", static_cast<unsigned>(c));
    } else {
      uri += c;
    }
  }
  return uri;
}

}  // namespace

Result<Database> Database::open(const std::filesystem::path& path, Access access, const std::string& vfs) {
  int flags = SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_EXRESCODE;
  const bool only_read = access == Access::read || access == Access::salvage;
  flags |= only_read ? SQLITE_OPEN_READONLY : SQLITE_OPEN_READWRITE;
  if (access == Access::create) flags |= SQLITE_OPEN_CREATE;
  Database database;
  database.path_ = path.string();
  sqlite3* connection = nullptr;
  if (access == Access::create && vfs.empty()) keep_private(path);
  const bool still = access == Access::read && vfs.empty() && cannot_change(path);
  const std::string name = still ? as_uri(database.path_) + "?immutable=1" : database.path_;
  if (still) flags |= SQLITE_OPEN_URI;
  const int opened = sqlite3_open_v2(name.c_str(), &connection, flags, vfs.empty() ? nullptr : vfs.c_str());
  database.connection_.reset(connection);
  if (opened != SQLITE_OK) return database.error("open");
  sqlite3_busy_timeout(connection, busy_timeout_ms);
  // What a damaged file holds is never run, and cells that reach out of their page are found at once.
  sqlite3_db_config(connection, SQLITE_DBCONFIG_DEFENSIVE, access == Access::salvage ? 0 : 1, nullptr);
  sqlite3_db_config(connection, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_db_config(connection, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
  // With it SQLite takes a file that is shorter than it says as it is; nothing can be written.
  if (access == Access::salvage) {
    if (auto status = database.execute("PRAGMA writable_schema=ON"); !status) return status.error();
  }
  for (const char* pragma : {"PRAGMA synchronous=FULL", "PRAGMA cell_size_check=ON", "PRAGMA mmap_size=0",
                             "PRAGMA temp_store=MEMORY", "PRAGMA wal_autocheckpoint=0"}) {
    if (auto status = database.execute(pragma); !status) return status.error();
  }
  sqlite3_wal_hook(
      connection,
      [](void* pages, sqlite3*, const char*, int waiting) {
        *static_cast<int*>(pages) = waiting;
        return SQLITE_OK;
      },
      database.pages_waiting_.get());
  return database;
}

Statement Database::prepare(std::string_view sql) const {
  sqlite3_stmt* statement = nullptr;
  sqlite3_prepare_v2(connection_.get(), sql.data(), static_cast<int>(sql.size()), &statement, nullptr);
  Statement result;
  result.statement_.reset(statement);
  return result;
}

Status Database::execute(const std::string& sql) {
  if (sqlite3_exec(connection_.get(), sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) return error(sql);
  return {};
}

Result<std::int64_t> Database::integer(const std::string& sql) const {
  Statement statement = prepare(sql);
  if (statement.step() != Statement::Step::row) return error(sql);
  return statement.integer(0);
}

Status Database::commit() {
  auto status = execute("COMMIT");
  if (!status) rollback();
  return status;
}

void Database::rollback() {
  if (sqlite3_get_autocommit(connection_.get()) == 0)
    sqlite3_exec(connection_.get(), "ROLLBACK", nullptr, nullptr, nullptr);
}

void Database::allow_checkpoints() {
  sqlite3_db_config(connection_.get(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 0, nullptr);
}

Status Database::checkpoint() {
  if (sqlite3_wal_checkpoint_v2(connection_.get(), nullptr, SQLITE_CHECKPOINT_PASSIVE, nullptr, nullptr) !=
      SQLITE_OK) {
    return error("checkpoint");
  }
  *pages_waiting_ = 0;
  return {};
}

bool Database::moved() const {
  int moved = 0;
  // A vfs that does not know says nothing.
  return sqlite3_file_control(connection_.get(), "main", SQLITE_FCNTL_HAS_MOVED, &moved) == SQLITE_OK &&
         moved != 0;
}

Status Database::copy_to(Database& to) const {
  constexpr int all_pages = -1;
  sqlite3_backup* backup = sqlite3_backup_init(to.connection_.get(), "main", connection_.get(), "main");
  if (backup == nullptr) return to.error("begin a backup");
  const int stepped = sqlite3_backup_step(backup, all_pages);
  const int finished = sqlite3_backup_finish(backup);
  if (stepped == SQLITE_DONE && finished == SQLITE_OK) return {};
  return to.error("back up");
}

Error Database::error(std::string_view doing) const {
  const auto is_forbidden = [](int number) { return number == EACCES || number == EPERM || number == EROFS; };
  std::error_code ignored;
  const int code = sqlite3_errcode(connection_.get());
  auto kind = ErrorCode::io;
  switch (code & 0xff) {
    case SQLITE_FULL:
      kind = ErrorCode::resource_exhausted;
      break;
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
      kind = ErrorCode::data_corrupt;
      break;
    case SQLITE_READONLY:
    case SQLITE_PERM:
      kind = ErrorCode::permission_denied;
      break;
    case SQLITE_CANTOPEN:
      kind = is_forbidden(sqlite3_system_errno(connection_.get()))            ? ErrorCode::permission_denied
             : std::filesystem::exists(std::filesystem::path(path_), ignored) ? ErrorCode::io
                                                                              : ErrorCode::not_found;
      break;
    case SQLITE_BUSY:
      kind = ErrorCode::failed_precondition;
      break;
    case SQLITE_CONSTRAINT:
      kind = ErrorCode::already_exists;
      break;
    default:
      break;
  }
  const char* words = code == SQLITE_FULL ? "the disk is full" : sqlite3_errmsg(connection_.get());
  return make_error(kind, fmt::format("{}: {} (SQLite {}, {})", path_, words, code, doing));
}

}  // namespace handloft::store
