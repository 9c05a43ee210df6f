#pragma once
// Frames on a stream: a little-endian u32 with the number of bytes that follow, then that many bytes, which
// are one serialised Envelope (PROTOCOL.md, "Framing"). Pure functions of bytes: no sockets here.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace handloft::v1 {
class Envelope;
}

namespace handloft::net {

inline constexpr std::size_t frame_header_bytes = 4;
inline constexpr std::uint32_t default_max_frame_bytes = 16u << 20;
/// Nobody who has not said hello may make us hold more than this (A1 of reliability.md).
inline constexpr std::uint32_t hello_max_frame_bytes = 4096;

/// Header and payload, ready to be written; shared, so that one serialisation serves every receiver.
using Frame = std::shared_ptr<const std::string>;

/// resource_exhausted when the envelope is larger than `max_frame_bytes`.
Result<Frame> encode_frame(const v1::Envelope& envelope,
                           std::uint32_t max_frame_bytes = default_max_frame_bytes);

/// Finds frames in a stream of bytes that arrives in pieces. Holds at most one frame's limit plus one read's
/// worth, and never allocates for bytes that have not arrived.
class FrameDecoder {
 public:
  explicit FrameDecoder(std::uint32_t max_frame_bytes = default_max_frame_bytes);

  /// For the frames after the one returned last.
  void set_max_frame_bytes(std::uint32_t max_frame_bytes) { max_frame_bytes_ = max_frame_bytes; }

  /// Room to read into, never empty; then commit() what was read. Invalidates payloads.
  std::span<std::uint8_t> prepare();
  void commit(std::size_t byte_count);
  /// prepare, copy and commit, for bytes that lie elsewhere.
  void append(std::span<const std::uint8_t> bytes);

  /// The next whole payload (valid until prepare(), append() or next()), nullopt when more bytes are needed,
  /// or resource_exhausted when a header announces more than the limit; the decoder stays in that error.
  Result<std::optional<std::span<const std::uint8_t>>> next();

  /// Bytes of an unfinished frame are waiting: a connection that ends now was cut.
  bool mid_frame() const { return end_ > begin_; }
  std::size_t capacity() const { return buffer_.size(); }

 private:
  std::vector<std::uint8_t> buffer_;
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
  std::uint32_t max_frame_bytes_;
};

/// One payload as an Envelope: data_corrupt for bytes that are no protobuf message, unsupported for a message
/// without a body that we know (an unknown kind of message). `envelope` may be reused from call to call.
Status parse_envelope(std::span<const std::uint8_t> payload, v1::Envelope& envelope);

}  // namespace handloft::net
