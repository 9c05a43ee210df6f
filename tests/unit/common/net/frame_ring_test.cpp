// Video through shared memory: newest wins, and a hostile writer cannot crash a reader.

#include "common/net/frame_ring.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <atomic>
#include <cstring>
#include <thread>

#include "common/net/frame_ring_layout.h"

namespace handloft::net {
namespace {

using Bytes = std::vector<std::uint8_t>;

FrameRingReader reader_of(const FrameRingWriter& writer) {
  auto reader = FrameRingReader::map(FileDescriptor(dup(writer.fd())));
  EXPECT_TRUE(reader.ok());
  return std::move(*reader);
}

VideoFrameInfo info(std::uint32_t camera, std::uint64_t sequence) {
  VideoFrameInfo result;
  result.camera = camera;
  result.sequence = sequence;
  result.exposure_time = from_ns(static_cast<std::int64_t>(sequence) * 1000);
  result.width_px = 640;
  result.height_px = 480;
  return result;
}

TEST(FrameRing, TheNewestFrameComesOnce) {
  auto writer = FrameRingWriter::create();
  ASSERT_TRUE(writer.ok()) << writer.error().describe();
  FrameRingReader reader = reader_of(*writer);
  VideoFrame frame;
  EXPECT_FALSE(reader.read_newest(frame)) << "nothing written yet";
  for (std::uint64_t i = 1; i <= 10; ++i) {
    ASSERT_TRUE(writer->write(info(0, i), Bytes{1, 2, static_cast<std::uint8_t>(i)}).ok());
  }
  ASSERT_TRUE(reader.read_newest(frame));
  EXPECT_EQ(frame.info.sequence, 10u);
  EXPECT_EQ(to_ns(frame.info.exposure_time), 10'000);
  EXPECT_EQ(frame.info.width_px, 640u);
  EXPECT_EQ(frame.bytes, (Bytes{1, 2, 10}));
  EXPECT_FALSE(reader.read_newest(frame));
}

TEST(FrameRing, OneCameraIsFoundAmongOthers) {
  auto writer = FrameRingWriter::create();
  FrameRingReader reader = reader_of(*writer);
  ASSERT_TRUE(writer->write(info(2, 1), Bytes{2}).ok());
  ASSERT_TRUE(writer->write(info(0, 2), Bytes{0}).ok());
  VideoFrame frame;
  ASSERT_TRUE(reader.read_newest(frame, 2));
  EXPECT_EQ(frame.info.camera, 2u);
  EXPECT_FALSE(reader.read_newest(frame, 2));
  EXPECT_FALSE(reader.read_newest(frame, 7));
  ASSERT_TRUE(reader.read_newest(frame));
  EXPECT_EQ(frame.info.camera, 0u);
}

TEST(FrameRing, BoundsAreChecked) {
  EXPECT_FALSE(FrameRingWriter::create({.slot_count = 1, .slot_bytes = 10}).ok());
  EXPECT_FALSE(FrameRingWriter::create({.slot_count = 4, .slot_bytes = 0}).ok());
  auto writer = FrameRingWriter::create({.slot_count = 2, .slot_bytes = 4});
  ASSERT_TRUE(writer.ok());
  EXPECT_TRUE(writer->write(info(0, 1), Bytes(4)).ok());
  EXPECT_EQ(writer->write(info(0, 2), Bytes(5)).error().code, ErrorCode::resource_exhausted);
}

TEST(FrameRing, ReadersGetNoTearingUnderAFastWriter) {
  auto writer = FrameRingWriter::create({.slot_count = 3, .slot_bytes = 1 << 16});
  FrameRingReader reader = reader_of(*writer);
  std::atomic<bool> done{false};
  std::thread writing([&] {
    Bytes bytes(1 << 15);
    for (std::uint64_t i = 1; i <= 3000; ++i) {
      std::fill(bytes.begin(), bytes.end(), static_cast<std::uint8_t>(i));
      static_cast<void>(writer->write(info(0, i), bytes).ok());
    }
    done = true;
  });
  VideoFrame frame;
  std::uint64_t last = 0;
  while (!done) {
    if (!reader.read_newest(frame)) continue;
    ASSERT_GT(frame.info.sequence, last);
    last = frame.info.sequence;
    ASSERT_EQ(frame.bytes, Bytes(1 << 15, static_cast<std::uint8_t>(last)));
  }
  writing.join();
}

// ---- hostile writers ----

class HostileRing {
 public:
  explicit HostileRing(std::size_t size, int seals = F_SEAL_SHRINK) : size_(size) {
    fd_ = memfd_create("hostile", MFD_ALLOW_SEALING);
    EXPECT_EQ(ftruncate(fd_, static_cast<off_t>(size)), 0);
    data_ = static_cast<std::uint8_t*>(mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, fd_, 0));
    if (seals != 0) {
      EXPECT_EQ(fcntl(fd_, F_ADD_SEALS, seals), 0);
    }
    const ring::Head head{ring::magic, 2, 4096};
    std::memcpy(data_, &head, sizeof(head));
  }
  ~HostileRing() {
    munmap(data_, size_);
    close(fd_);
  }
  ring::Head& head() { return *reinterpret_cast<ring::Head*>(data_); }
  ring::SlotHead& slot() { return *reinterpret_cast<ring::SlotHead*>(data_ + ring::page_bytes); }
  Result<FrameRingReader> map() const { return FrameRingReader::map(FileDescriptor(dup(fd_))); }

 private:
  std::size_t size_;
  int fd_ = -1;
  std::uint8_t* data_ = nullptr;
};

TEST(FrameRingHostile, HeadsThatPromiseTooMuchAreRefused) {
  const std::size_t fitting = ring::total_bytes(2, 4096);
  EXPECT_TRUE(HostileRing(fitting).map().ok());
  EXPECT_FALSE(HostileRing(fitting - 4096).map().ok()) << "too small for its slots";
  EXPECT_FALSE(HostileRing(fitting, 0).map().ok()) << "could be shrunk under the reader";
  HostileRing bad(fitting);
  bad.head().slot_count = 0xFFFFFFFF;
  EXPECT_EQ(bad.map().error().code, ErrorCode::data_corrupt);
  bad.head().slot_count = 2;
  bad.head().slot_bytes = 0xFFFFFFF0;
  EXPECT_FALSE(bad.map().ok());
  bad.head().slot_bytes = 4096;
  bad.head().magic[0] = 'X';
  EXPECT_FALSE(bad.map().ok());
  int pipe_ends[2];
  ASSERT_EQ(pipe(pipe_ends), 0);
  EXPECT_FALSE(FrameRingReader::map(FileDescriptor(pipe_ends[0])).ok());
  close(pipe_ends[1]);
}

TEST(FrameRingHostile, SlotsThatMakeNoSenseAreNotRead) {
  HostileRing ring(ring::total_bytes(2, 4096));
  auto reader = ring.map();
  ASSERT_TRUE(reader.ok());
  VideoFrame frame;
  const auto fill = [&](std::uint32_t lock, std::uint32_t bytes, std::uint32_t format) {
    ring.slot().lock = lock;
    ring.slot().ordinal = 1;
    ring.slot().byte_count = bytes;
    ring.slot().format = format;
    return reader->read_newest(frame);
  };
  EXPECT_FALSE(fill(2, 0xFFFFFFFF, 1)) << "more bytes than a slot has";
  EXPECT_FALSE(fill(3, 10, 1)) << "for ever being written";
  EXPECT_FALSE(fill(2, 10, 77)) << "unknown format";
  ring.head().slot_bytes = 1u << 30;  // after the mapping: must not be believed
  EXPECT_FALSE(fill(2, 4097, 1));
  EXPECT_TRUE(fill(2, 4096, 1));
  EXPECT_EQ(frame.bytes.size(), 4096u);
}

}  // namespace
}  // namespace handloft::net
