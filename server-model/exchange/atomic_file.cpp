#include "server-model/exchange/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <system_error>

namespace handloft::exchange {
namespace {

namespace fs = std::filesystem;

Error io_error(const fs::path& path, std::string_view doing, int reason) {
  return make_error(
      ErrorCode::io,
      fmt::format("{}: {} failed: {}", path.string(), doing, std::generic_category().message(reason)),
      "path");
}

class Descriptor {
 public:
  explicit Descriptor(int value) : value_(value) {}
  ~Descriptor() {
    if (value_ >= 0) ::close(value_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return value_; }
  /// close() may be the one to report a full disk (NFS).
  int close() {
    const int result = ::close(value_);
    value_ = -1;
    return result;
  }

 private:
  int value_;
};

/// Removes the temporary file unless it has become the real one.
class TemporaryFile {
 public:
  explicit TemporaryFile(fs::path path) : path_(std::move(path)) {}
  ~TemporaryFile() {
    if (!path_.empty()) ::unlink(path_.c_str());
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  const fs::path& path() const { return path_; }
  void keep() { path_.clear(); }

 private:
  fs::path path_;
};

fs::path folder_of(const fs::path& path) {
  return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

/// Unique in this process and among processes; hidden, and keeps the extension for libraries that look at it.
fs::path temporary_name(const fs::path& path) {
  static std::atomic<unsigned> counter{0};
  return folder_of(path) / fmt::format(".{}.{}-{}.tmp{}", path.stem().string(), ::getpid(), counter++,
                                       path.extension().string());
}

Status flush_to_disk(const fs::path& path, int open_flags) {
  Descriptor descriptor(::open(path.c_str(), open_flags | O_CLOEXEC));
  if (descriptor.get() < 0) return io_error(path, "opening", errno);
  if (::fsync(descriptor.get()) != 0) return io_error(path, "flushing to the disk", errno);
  return {};
}

/// The new file gets the permissions of the one that it replaces.
void copy_permissions(const fs::path& from, const fs::path& to) {
  struct stat status {};
  if (::stat(from.c_str(), &status) == 0) (void)::chmod(to.c_str(), status.st_mode & 07777);
}

}  // namespace

Status write_file_atomically(const fs::path& path, const std::function<Status(const fs::path&)>& write) {
  std::error_code ignored;
  if (path.filename().empty() || fs::is_directory(path, ignored)) {
    return make_error(ErrorCode::io, fmt::format("{} is no file name", path.string()), "path");
  }
  // A link is followed, so that its target is replaced and not the link.
  const fs::path target = fs::is_symlink(path, ignored) ? fs::weakly_canonical(path, ignored) : path;
  // A device or a pipe would be replaced by a file: /dev/full gone for the whole machine, if root exports to
  // it.
  if (fs::exists(target, ignored) && !fs::is_regular_file(target, ignored)) {
    return make_error(ErrorCode::io, fmt::format("{} is a device or a pipe, expected a file", path.string()),
                      "path");
  }
  TemporaryFile temporary(temporary_name(target));
  if (Status status = write(temporary.path()); !status.ok()) return status;
  if (Status status = flush_to_disk(temporary.path(), O_RDONLY); !status.ok()) return status;
  copy_permissions(target, temporary.path());
  if (::rename(temporary.path().c_str(), target.c_str()) != 0) return io_error(path, "renaming", errno);
  temporary.keep();
  // The name itself must survive a power cut, too. The content is whole either way, so a folder that can't be
  // flushed (some network file systems) is no failure.
  (void)flush_to_disk(folder_of(target), O_RDONLY | O_DIRECTORY).ok();
  return {};
}

Status write_file_atomically(const fs::path& path, std::span<const std::byte> content) {
  return write_file_atomically(path, [&](const fs::path& temporary) -> Status {
    constexpr mode_t everyone_may_read = 0666;  // Less the user's umask.
    Descriptor file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, everyone_may_read));
    if (file.get() < 0) return io_error(path, "creating", errno);
    std::size_t written = 0;
    while (written < content.size()) {
      const ssize_t count = ::write(file.get(), content.data() + written, content.size() - written);
      if (count < 0 && errno == EINTR) continue;
      if (count < 0) return io_error(path, "writing", errno);
      written += static_cast<std::size_t>(count);
    }
    if (::fsync(file.get()) != 0) return io_error(path, "flushing to the disk", errno);
    if (file.close() != 0) return io_error(path, "closing", errno);
    return {};
  });
}

Status write_file_atomically(const fs::path& path, std::string_view content) {
  return write_file_atomically(path, std::as_bytes(std::span(content)));
}

}  // namespace handloft::exchange
