#include "common/net/frame_ring.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/magic.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <map>

#include "common/net/frame_ring_layout.h"

namespace handloft::net {

namespace {

/// How often a reader tries when the writer overtakes it; four slots at 30 Hz leave 100 ms for a copy of 1
/// ms.
constexpr int read_attempts = 4;

Error ring_error(ErrorCode code, std::string message) {
  return make_error(code, std::move(message), "video ring");
}

Error system_failure(std::string_view what) {
  return ring_error(ErrorCode::io, fmt::format("{}: {}", what, std::strerror(errno)));
}

struct Mapping {
  std::uint8_t* data = nullptr;
  std::size_t size = 0;
  std::uint32_t slot_count = 0;
  std::uint32_t slot_bytes = 0;

  Mapping() = default;
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;
  ~Mapping() {
    if (data != nullptr) munmap(data, size);
  }
  ring::SlotHead* slot(std::uint32_t index) const {
    return reinterpret_cast<ring::SlotHead*>(data + ring::page_bytes + index * ring::stride(slot_bytes));
  }
  std::uint8_t* bytes(std::uint32_t index) const {
    return reinterpret_cast<std::uint8_t*>(slot(index)) + ring::slot_head_bytes;
  }
};

}  // namespace

// ---- writer ----

struct FrameRingWriter::Implementation {
  FileDescriptor fd;
  Mapping memory;
  std::uint64_t ordinal = 0;
};

FrameRingWriter::FrameRingWriter(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
FrameRingWriter::FrameRingWriter(FrameRingWriter&&) noexcept = default;
FrameRingWriter& FrameRingWriter::operator=(FrameRingWriter&&) noexcept = default;
FrameRingWriter::~FrameRingWriter() = default;

Result<FrameRingWriter> FrameRingWriter::create(FrameRingOptions options) {
  if (options.slot_count < 2 || options.slot_count > ring::max_slots || options.slot_bytes == 0 ||
      options.slot_bytes > ring::max_slot_bytes) {
    return ring_error(ErrorCode::invalid_argument,
                      fmt::format("found {} slots of {} bytes, expected 2..{} of 1..{}", options.slot_count,
                                  options.slot_bytes, ring::max_slots, ring::max_slot_bytes));
  }
  auto writer = std::make_unique<Implementation>();
  writer->fd.reset(memfd_create("handloft-video", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (!writer->fd.valid()) return system_failure("memfd_create");
  Mapping& memory = writer->memory;
  memory.size = ring::total_bytes(options.slot_count, options.slot_bytes);
  memory.slot_count = options.slot_count;
  memory.slot_bytes = options.slot_bytes;
  if (ftruncate(writer->fd.get(), static_cast<off_t>(memory.size)) != 0) return system_failure("ftruncate");
  void* mapped = mmap(nullptr, memory.size, PROT_READ | PROT_WRITE, MAP_SHARED, writer->fd.get(), 0);
  if (mapped == MAP_FAILED) return system_failure("mmap");
  memory.data = static_cast<std::uint8_t*>(mapped);
  const ring::Head head{ring::magic, options.slot_count, options.slot_bytes};
  std::memcpy(memory.data, &head, sizeof(head));
  // Nobody can change the size any more (which would crash readers), nor write but through our own mapping.
  const int seals = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_FUTURE_WRITE | F_SEAL_SEAL;
  if (fcntl(writer->fd.get(), F_ADD_SEALS, seals) != 0) return system_failure("sealing");
  return FrameRingWriter(std::move(writer));
}

Status FrameRingWriter::write(const VideoFrameInfo& info, std::span<const std::uint8_t> bytes) {
  Implementation& writer = *implementation_;
  if (bytes.size() > writer.memory.slot_bytes) {
    return ring_error(ErrorCode::resource_exhausted, fmt::format("a frame of {} bytes, a slot holds {}",
                                                                 bytes.size(), writer.memory.slot_bytes));
  }
  const auto index = static_cast<std::uint32_t>(writer.ordinal % writer.memory.slot_count);
  ring::SlotHead& slot = *writer.memory.slot(index);
  const std::uint32_t lock = slot.lock.load(std::memory_order_relaxed);
  slot.lock.store(lock + 1, std::memory_order_relaxed);
  std::atomic_thread_fence(std::memory_order_release);
  slot.camera = info.camera;
  slot.ordinal = ++writer.ordinal;
  slot.sequence = info.sequence;
  slot.exposure_ns = to_ns(info.exposure_time);
  slot.format = static_cast<std::uint32_t>(info.format);
  slot.width_px = info.width_px;
  slot.height_px = info.height_px;
  slot.byte_count = static_cast<std::uint32_t>(bytes.size());
  std::copy(bytes.begin(), bytes.end(), writer.memory.bytes(index));
  slot.lock.store(lock + 2, std::memory_order_release);
  return {};
}

int FrameRingWriter::fd() const {
  return implementation_->fd.get();
}

// ---- reader ----

struct FrameRingReader::Implementation {
  FileDescriptor fd;
  Mapping memory;
  std::map<std::optional<std::uint32_t>, std::uint64_t> last;  // per question asked

  struct Seen {
    std::uint32_t index = 0;
    std::uint32_t lock = 0;
    std::uint32_t camera = 0;
    std::uint32_t byte_count = 0;
    std::uint64_t ordinal = 0;
    VideoFrameInfo info;
  };

  /// A slot's head as of one moment; nullopt while it is being written or when it makes no sense.
  std::optional<Seen> look(std::uint32_t index) const {
    const ring::SlotHead& slot = *memory.slot(index);
    Seen seen;
    seen.index = index;
    seen.lock = slot.lock.load(std::memory_order_acquire);
    seen.ordinal = slot.ordinal;
    seen.byte_count = slot.byte_count;
    seen.info.camera = slot.camera;
    seen.info.sequence = slot.sequence;
    seen.info.exposure_time = from_ns(slot.exposure_ns);
    const std::uint32_t format = slot.format;
    seen.info.format = static_cast<VideoFormat>(format);
    seen.info.width_px = slot.width_px;
    seen.info.height_px = slot.height_px;
    if (!unchanged(seen)) return std::nullopt;
    const bool sane = seen.ordinal != 0 && seen.byte_count <= memory.slot_bytes &&
                      format >= static_cast<std::uint32_t>(VideoFormat::jpeg) &&
                      format <= static_cast<std::uint32_t>(VideoFormat::rgb);
    if (!sane) return std::nullopt;
    return seen;
  }

  bool unchanged(const Seen& seen) const {
    std::atomic_thread_fence(std::memory_order_acquire);
    return (seen.lock & 1u) == 0 &&
           memory.slot(seen.index)->lock.load(std::memory_order_relaxed) == seen.lock;
  }
};

FrameRingReader::FrameRingReader(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
FrameRingReader::FrameRingReader(FrameRingReader&&) noexcept = default;
FrameRingReader& FrameRingReader::operator=(FrameRingReader&&) noexcept = default;
FrameRingReader::~FrameRingReader() = default;

Result<FrameRingReader> FrameRingReader::map(FileDescriptor fd) {
  // Memory that could still shrink would kill us with SIGBUS at the writer's whim.
  const int seals = fcntl(fd.get(), F_GET_SEALS);
  if (seals < 0 || (seals & F_SEAL_SHRINK) == 0) {
    return ring_error(ErrorCode::data_corrupt, "the memory is not sealed against shrinking");
  }
  // Huge pages that cannot be had when they are touched would kill us as well.
  struct statfs home {};
  if (fstatfs(fd.get(), &home) != 0) return system_failure("fstatfs");
  if (home.f_type != TMPFS_MAGIC) return ring_error(ErrorCode::data_corrupt, "the memory is no plain memfd");
  struct stat status {};
  if (fstat(fd.get(), &status) != 0) return system_failure("fstat");
  const auto size = static_cast<std::size_t>(std::max<off_t>(status.st_size, 0));
  if (size < ring::page_bytes || size > ring::total_bytes(ring::max_slots, ring::max_slot_bytes)) {
    return ring_error(ErrorCode::data_corrupt, fmt::format("{} bytes are no ring", size));
  }
  auto reader = std::make_unique<Implementation>();
  void* mapped = mmap(nullptr, size, PROT_READ, MAP_SHARED, fd.get(), 0);
  if (mapped == MAP_FAILED) return system_failure("mmap");
  reader->memory.data = static_cast<std::uint8_t*>(mapped);
  reader->memory.size = size;
  ring::Head head{};
  std::memcpy(&head, mapped, sizeof(head));
  if (head.magic != ring::magic)
    return ring_error(ErrorCode::data_corrupt, "the memory holds no ring of version 1");
  if (head.slot_count == 0 || head.slot_count > ring::max_slots || head.slot_bytes > ring::max_slot_bytes ||
      ring::total_bytes(head.slot_count, head.slot_bytes) > size) {
    return ring_error(ErrorCode::data_corrupt, fmt::format("{} slots of {} bytes do not fit into {} bytes",
                                                           head.slot_count, head.slot_bytes, size));
  }
  reader->memory.slot_count = head.slot_count;  // read once: the writer may change its mind, we do not
  reader->memory.slot_bytes = head.slot_bytes;
  reader->fd = std::move(fd);
  return FrameRingReader(std::move(reader));
}

bool FrameRingReader::read_newest(VideoFrame& frame, std::optional<std::uint32_t> camera) {
  Implementation& reader = *implementation_;
  std::uint64_t& last = reader.last[camera];
  for (int attempt = 0; attempt < read_attempts; ++attempt) {
    std::optional<Implementation::Seen> newest;
    for (std::uint32_t index = 0; index < reader.memory.slot_count; ++index) {
      const auto seen = reader.look(index);
      if (!seen || seen->ordinal <= last || (camera && seen->info.camera != *camera)) continue;
      if (!newest || seen->ordinal > newest->ordinal) newest = seen;
    }
    if (!newest) return false;
    frame.bytes.resize(newest->byte_count);
    std::copy_n(reader.memory.bytes(newest->index), newest->byte_count, frame.bytes.begin());
    if (!reader.unchanged(*newest)) continue;
    frame.info = newest->info;
    last = newest->ordinal;
    return true;
  }
  return false;
}

}  // namespace handloft::net
