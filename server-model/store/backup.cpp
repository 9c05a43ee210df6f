#include "server-model/store/backup.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>
#include <utility>

#include "server-model/store/database.h"
#include "server-model/store/log_check.h"
#include "server-model/store/operation_log.h"
#include "server-model/store/side_files.h"

namespace handloft::store {

namespace {

namespace fs = std::filesystem;

Status flush(const fs::path& path, int flags) {
  const int file = ::open(path.c_str(), flags | O_CLOEXEC);
  const bool flushed = file >= 0 && ::fsync(file) == 0;
  const int problem = errno;
  if (file >= 0) ::close(file);
  if (flushed) return {};
  return make_error(ErrorCode::io, fmt::format("{}: {}", path.string(), std::strerror(problem)), "TO");
}

/// Goes with all that SQLite has put beside it; what it was renamed to stays.
class Part {
 public:
  /// A new file, which nobody else can have meant, for its owner alone. Errors: io; not_found;
  /// permission_denied.
  static Result<Part> beside(const fs::path& to) {
    std::string name = to.string() + ".part-XXXXXX";
    const int file = ::mkostemp(name.data(), O_CLOEXEC);
    if (file < 0) {
      const ErrorCode code = errno == ENOENT                     ? ErrorCode::not_found
                             : errno == EACCES || errno == EROFS ? ErrorCode::permission_denied
                                                                 : ErrorCode::io;
      return make_error(code, fmt::format("{}: {}", to.string(), std::strerror(errno)), "TO");
    }
    ::close(file);
    return Part(std::move(name));
  }
  ~Part() {
    if (!path_.empty()) remove();
  }
  Part(Part&& other) noexcept : path_(std::exchange(other.path_, {})) {}
  Part& operator=(Part&&) = delete;
  Part(const Part&) = delete;
  Part& operator=(const Part&) = delete;
  const fs::path& path() const { return path_; }
  /// Errors: already_exists; io.
  Status name(const fs::path& to) {
    // A link never replaces what is there.
    if (::link(path_.c_str(), to.c_str()) != 0) {
      return make_error(errno == EEXIST ? ErrorCode::already_exists : ErrorCode::io,
                        fmt::format("{}: {}", to.string(), std::strerror(errno)), "TO");
    }
    return {};
  }

 private:
  explicit Part(fs::path path) : path_(std::move(path)) {}
  void remove() const {
    std::error_code ignored;
    fs::remove(path_, ignored);
    for (const char* suffix : side_suffixes) fs::remove(path_.string() + suffix, ignored);
  }
  fs::path path_;
};

}  // namespace

Result<Backup> back_up(const fs::path& model, const fs::path& to) {
  std::error_code ignored;
  if (fs::exists(to, ignored))
    return make_error(ErrorCode::already_exists, fmt::format("{} is there already", to.string()), "TO");
  // Says what is no model, before anything is written.
  // What is saved from here on may be in the copy, and all before it must be.
  const auto mark = AckMark::read(model);
  if (auto log = OperationLog::open(model, OperationLog::Access::read); !log) return log.error();
  auto from = Database::open(model, Database::Access::read, "");
  if (!from) return from.error();
  auto made = Part::beside(to);
  if (!made) return made.error();
  Part part = *std::move(made);
  {
    auto copy = Database::open(part.path(), Database::Access::create, "");
    if (!copy) return copy.error();
    if (const Status copied = from->copy_to(*copy); !copied) return copied.error();
  }
  if (const Status flushed = flush(part.path(), O_RDONLY); !flushed) return flushed.error();
  Backup backup;
  {
    auto log = OperationLog::open(part.path(), OperationLog::Access::read);
    if (!log) return log.error();
    const LogCheck check = check_log(*log);
    if (!check.good())
      return make_error(ErrorCode::data_corrupt,
                        fmt::format("{}: {}", model.string(), check.damages[0].words()), "MODEL");
    if (const Status saved = log->holds_what_was_saved(mark); !saved)
      return make_error(saved.error().code,
                        fmt::format("{} lacks what was saved, and was not copied: {}", model.string(),
                                    saved.error().message),
                        "MODEL");
    backup.operations = log->last_sequence();
  }
  backup.bytes = fs::file_size(part.path(), ignored);
  if (const Status named = part.name(to); !named) return named.error();
  const fs::path folder = to.has_parent_path() ? to.parent_path() : fs::path(".");
  if (const Status flushed = flush(folder, O_RDONLY | O_DIRECTORY); !flushed) return flushed.error();
  return backup;
}

}  // namespace handloft::store
