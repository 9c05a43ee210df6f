// Preloaded beside umockdev's own library: lets its mock camera nodes be mapped. They are pseudo terminals,
// which can be polled but not mapped; the mapping comes from the file $UMOCKDEV_DIR/mmap/<number of the
// terminal> instead, which MockVideoNode fills.

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace {

// System calls alone: memory allocators and sanitizers map before anything else of the program is ready.
void* map_directly(void* address, std::size_t length, int protection, int flags, int fd, off_t offset) {
  return reinterpret_cast<void*>(::syscall(SYS_mmap, address, length, protection, flags, fd, offset));
}

// The file that stands in for the terminal `fd`, or -1.
int open_stand_in(int fd) {
  const char* mock = std::getenv("UMOCKDEV_DIR");
  if (mock == nullptr) return -1;
  char link[64], target[64] = {}, path[512];
  std::snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
  constexpr char terminals[] = "/dev/pts/";
  constexpr std::size_t prefix = sizeof terminals - 1;
  const long length = ::syscall(SYS_readlink, link, target, sizeof target - 1);
  if (length <= static_cast<long>(prefix) || std::strncmp(target, terminals, prefix) != 0) return -1;
  std::snprintf(path, sizeof path, "%s/mmap/%s", mock, target + prefix);
  return static_cast<int>(::syscall(SYS_openat, AT_FDCWD, path, O_RDWR | O_CLOEXEC));
}

}  // namespace

extern "C" void* mmap(void* address, std::size_t length, int protection, int flags, int fd,
                      off_t offset) noexcept {
  const int stand_in = fd >= 0 && (flags & MAP_SHARED) != 0 ? open_stand_in(fd) : -1;
  if (stand_in < 0) return map_directly(address, length, protection, flags, fd, offset);
  void* mapped = map_directly(address, length, protection, flags, stand_in, offset);
  ::syscall(SYS_close, stand_in);
  return mapped;
}

extern "C" void* mmap64(void* address, std::size_t length, int protection, int flags, int fd,
                        off64_t offset) noexcept {
  return mmap(address, length, protection, flags, fd, offset);
}
