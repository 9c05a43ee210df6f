// Any bytes as the shared memory of a video ring: a reader neither crashes nor reads beyond a slot.

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>

#include "common/net/frame_ring.h"
#include "common/net/frame_ring_layout.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace handloft::net;
  // The input lies thinned over the memory: the head, then a slot's head a page.
  const int fd = memfd_create("fuzz", MFD_ALLOW_SEALING);
  const std::size_t bytes = 8 * ring::page_bytes;
  if (fd < 0 || ftruncate(fd, static_cast<off_t>(bytes)) != 0) std::abort();
  for (std::size_t page = 0; page * ring::slot_head_bytes < size && page < 8; ++page) {
    const std::size_t at = page * ring::slot_head_bytes;
    const std::size_t count = std::min(ring::slot_head_bytes, size - at);
    if (pwrite(fd, data + at, count, static_cast<off_t>(page * ring::page_bytes)) < 0) std::abort();
  }
  if (fcntl(fd, F_ADD_SEALS, F_SEAL_SHRINK) != 0) std::abort();
  auto reader = FrameRingReader::map(FileDescriptor(fd));
  if (!reader) return 0;
  VideoFrame frame;
  while (reader->read_newest(frame)) {
    if (frame.bytes.size() > bytes) std::abort();
  }
  static_cast<void>(reader->read_newest(frame, 1));
  return 0;
}
