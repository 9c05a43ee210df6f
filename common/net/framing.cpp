#include "common/net/framing.h"

#include <fmt/format.h>
#include <google/protobuf/stubs/logging.h>

#include <algorithm>
#include <cstring>

#include "proto/session.pb.h"

namespace handloft::net {

namespace {

/// Room for one read: most frames of tracking and of scene deltas fit, so that one system call brings them.
constexpr std::size_t read_bytes = 64u << 10;
/// A buffer that one large frame blew up is given back once it is empty.
constexpr std::size_t keep_bytes = 256u << 10;

std::uint32_t read_u32(const std::uint8_t* bytes) {
  return static_cast<std::uint32_t>(bytes[0]) | static_cast<std::uint32_t>(bytes[1]) << 8 |
         static_cast<std::uint32_t>(bytes[2]) << 16 | static_cast<std::uint32_t>(bytes[3]) << 24;
}

}  // namespace

Result<Frame> encode_frame(const v1::Envelope& envelope, std::uint32_t max_frame_bytes) {
  const std::size_t size = envelope.ByteSizeLong();
  if (size > max_frame_bytes) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("the message has {} bytes, at most {} are allowed", size, max_frame_bytes),
                      "frame");
  }
  auto bytes = std::make_shared<std::string>();
  bytes->resize(frame_header_bytes + size);
  auto* out = reinterpret_cast<std::uint8_t*>(bytes->data());
  for (std::size_t i = 0; i < frame_header_bytes; ++i) out[i] = static_cast<std::uint8_t>(size >> (8 * i));
  envelope.SerializeWithCachedSizesToArray(out + frame_header_bytes);
  return Frame(std::move(bytes));
}

FrameDecoder::FrameDecoder(std::uint32_t max_frame_bytes) : max_frame_bytes_(max_frame_bytes) {}

std::span<std::uint8_t> FrameDecoder::prepare() {
  const std::size_t room =
      std::min<std::size_t>(read_bytes, std::size_t{max_frame_bytes_} + frame_header_bytes);
  if (begin_ == end_) {
    begin_ = end_ = 0;
    if (buffer_.size() > keep_bytes) std::vector<std::uint8_t>().swap(buffer_);
  }
  if (buffer_.size() - end_ < room) {
    if (begin_ > 0) {
      std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
      end_ -= begin_;
      begin_ = 0;
    }
    // Twice what has arrived, so that a long frame is copied a constant number of times and an announcement
    // of bytes that never come costs nothing.
    if (buffer_.size() - end_ < room) buffer_.resize(end_ + std::max(room, std::min(end_, keep_bytes * 4)));
  }
  return std::span(buffer_).subspan(end_);
}

void FrameDecoder::commit(std::size_t byte_count) {
  end_ += std::min(byte_count, buffer_.size() - end_);
}

void FrameDecoder::append(std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const std::span<std::uint8_t> room = prepare();
    const std::size_t count = std::min(room.size(), bytes.size());
    std::memcpy(room.data(), bytes.data(), count);
    commit(count);
    bytes = bytes.subspan(count);
  }
}

Result<std::optional<std::span<const std::uint8_t>>> FrameDecoder::next() {
  const std::size_t available = end_ - begin_;
  if (available < frame_header_bytes) return std::optional<std::span<const std::uint8_t>>();
  const std::uint32_t size = read_u32(buffer_.data() + begin_);
  if (size > max_frame_bytes_) {
    return make_error(
        ErrorCode::resource_exhausted,
        fmt::format("a frame of {} bytes was announced, at most {} are allowed", size, max_frame_bytes_),
        "frame");
  }
  if (available - frame_header_bytes < size) return std::optional<std::span<const std::uint8_t>>();
  const std::span<const std::uint8_t> payload(buffer_.data() + begin_ + frame_header_bytes, size);
  begin_ += frame_header_bytes + size;
  return std::optional(payload);
}

Status parse_envelope(std::span<const std::uint8_t> payload, v1::Envelope& envelope) {
  // Protobuf would write to standard error about what a peer sends; our own errors say it, once a connection.
  [[maybe_unused]] static auto* const former_handler = google::protobuf::SetLogHandler(nullptr);
  if (!envelope.ParseFromArray(payload.data(), static_cast<int>(payload.size()))) {
    return make_error(ErrorCode::data_corrupt,
                      fmt::format("the frame's {} bytes are not an Envelope", payload.size()), "envelope");
  }
  if (envelope.body_case() == v1::Envelope::BODY_NOT_SET) {
    return make_error(ErrorCode::unsupported, "found a message without a body, or of a kind not known here",
                      "envelope.body");
  }
  return {};
}

}  // namespace handloft::net
