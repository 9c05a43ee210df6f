#include "client-hmd/main/client_key.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "common/net/message_client.h"

namespace handloft::client {
namespace {

constexpr std::size_t key_bytes = 32;
constexpr mode_t for_this_user = S_IRUSR | S_IWUSR;

bool is_set(const char* text) {
  return text != nullptr && *text != '\0';
}

std::filesystem::path folder_of(const char* state_home, const char* home) {
  if (is_set(state_home)) return std::filesystem::path(state_home) / "handloft";
  if (is_set(home)) return std::filesystem::path(home) / ".local" / "state" / "handloft";
  return {};
}

}  // namespace

ClientKey ClientKey::open(const char* state_home, const char* home, const Logger& log) {
  ClientKey key;
  const std::filesystem::path folder = folder_of(state_home, home);
  if (folder.empty()) return key;
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  const std::filesystem::path path = folder / "client_key";
  net::FileDescriptor file(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, for_this_user));
  if (file.get() < 0) {
    log.info("no key is kept in {}: {}", path.string(), std::strerror(errno));
    return key;
  }
  if (::flock(file.get(), LOCK_EX | LOCK_NB) != 0) return key;  // Another program uses it.
  struct stat about {};
  if (::fstat(file.get(), &about) != 0 || (about.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
    log.warning("others may read {}, so it is not used: give it the mode 0600", path.string());
    return key;
  }
  std::array<char, key_bytes> held{};
  if (::pread(file.get(), held.data(), held.size(), 0) == static_cast<ssize_t>(held.size())) {
    key.bytes_.assign(held.data(), held.size());
  } else {
    std::string made = net::random_client_key();
    made.resize(key_bytes, '\0');
    if (::pwrite(file.get(), made.data(), made.size(), 0) != static_cast<ssize_t>(made.size())) {
      log.info("no key is kept in {}: {}", path.string(), std::strerror(errno));
      return key;
    }
    (void)::fsync(file.get());
    key.bytes_ = std::move(made);
  }
  key.lock_ = std::move(file);
  return key;
}

}  // namespace handloft::client
