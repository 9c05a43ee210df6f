#pragma once
// The recording file: append-only, checksummed, readable after a crash. A magic and version, metadata, then
// records {length, type, time, CRC32C}. What the types mean is the writer's program's business.
//
// Layout, little-endian:
//   8 bytes  "HLREC\x01\r\n" (the \x01 is the major version; \r\n shows a text-mode transfer)
//   u32 n, n bytes of metadata (JSON object), u32 CRC32C of those bytes
//   records: u32 length | u16 type | u16 zero | i64 time_ns | u32 CRC32C of the payload |
//            u32 CRC32C of the preceding 20 bytes | payload
// A record's head has its own checksum, so that a damaged length is told apart from a file that was cut.

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/result.h"

namespace handloft::record {

/// Larger than any frame of a camera; a length beyond it is corruption.
inline constexpr std::uint32_t max_record_bytes = 64u << 20;
inline constexpr std::uint32_t max_metadata_bytes = 1u << 20;

struct Metadata {
  std::string program;           ///< "handloft-trackd 0.1.0"
  std::string started_at;        ///< Wall clock, ISO 8601 UTC: the only wall clock time in the file.
  std::int64_t started_at_ns{};  ///< CLOCK_MONOTONIC at the same moment.
  std::map<std::string, std::string> more;  ///< The writer's own: rig, options.
};

/// `started_at` for now.
std::string wall_clock_now();

struct Record {
  std::uint16_t type = 0;
  TimePoint time;
  std::span<const std::uint8_t> payload;  ///< Valid until the next call of the reader.
};

struct WriterOptions {
  std::chrono::milliseconds flush_interval{200};  ///< A crash of the program loses at most this much.
  std::size_t buffer_bytes = 1u << 20;
};

/// Not thread-safe. The file is written as it is named (an existing one is replaced).
class RecordingWriter {
 public:
  static Result<RecordingWriter> create(const std::filesystem::path& path, const Metadata& metadata,
                                        const Clock& clock, WriterOptions options = {});
  RecordingWriter(RecordingWriter&&) noexcept;
  RecordingWriter& operator=(RecordingWriter&&) noexcept;
  /// finish(), its error unseen.
  ~RecordingWriter();

  /// io (full disk) names the file; after an error every further call returns it too and writes nothing, so
  /// what stands in the file stays a readable prefix.
  Status append(std::uint16_t type, TimePoint time, std::span<const std::uint8_t> payload);
  Status flush();
  /// Flushes to the disk and closes.
  Status finish();
  std::uint64_t record_count() const;

 private:
  struct Implementation;
  explicit RecordingWriter(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

/// How a recording ended.
enum class RecordingEnd {
  complete,   ///< After a whole record.
  truncated,  ///< In the middle of one, as after a crash; that one is left out.
};

/// Reads a file from front to back in bounded memory. Not thread-safe.
class RecordingReader {
 public:
  /// Errors: not_found, unsupported (another major version), data_corrupt (no recording, bad metadata).
  static Result<RecordingReader> open(const std::filesystem::path& path);
  /// The same from bytes in memory, which must outlive it: for tests and fuzzing.
  static Result<RecordingReader> from_bytes(std::span<const std::uint8_t> bytes, std::string name);
  RecordingReader(RecordingReader&&) noexcept;
  RecordingReader& operator=(RecordingReader&&) noexcept;
  ~RecordingReader();

  const Metadata& metadata() const;
  /// The next record; nullopt at the end (see end()). A damaged record is data_corrupt, naming the file and
  /// the byte offset, and so is every later call: lengths behind it cannot be trusted.
  Result<std::optional<Record>> next();
  /// After next() gave nullopt.
  RecordingEnd end() const;
  /// Where the next record starts, in bytes from the front.
  std::uint64_t offset() const;

 private:
  struct Implementation;
  explicit RecordingReader(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace handloft::record
