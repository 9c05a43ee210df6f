#pragma once
// The shared memory of a video ring, as PROTOCOL.md ("Video ring") describes it to foreign readers. Native
// byte order: it never leaves the machine. One header page, then slots of equal stride, each a SlotHead and
// its bytes.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace handloft::net::ring {

inline constexpr std::array<char, 8> magic{'H', 'L', 'V', 'I', 'D', 'E', 'O', 1};
inline constexpr std::size_t page_bytes = 4096;
inline constexpr std::uint32_t max_slots = 64;
inline constexpr std::uint32_t max_slot_bytes = 64u << 20;

struct Head {
  std::array<char, 8> magic;
  std::uint32_t slot_count;
  std::uint32_t slot_bytes;
};

/// `lock` is odd while the writer is in the slot and grows by two with each frame. `ordinal` counts the
/// frames of the whole ring from 1; 0: never written.
struct SlotHead {
  std::atomic<std::uint32_t> lock;
  std::uint32_t camera;
  std::uint64_t ordinal;
  std::uint64_t sequence;
  std::int64_t exposure_ns;
  std::uint32_t format;
  std::uint32_t width_px;
  std::uint32_t height_px;
  std::uint32_t byte_count;
};
static_assert(sizeof(SlotHead) == 48 && std::atomic<std::uint32_t>::is_always_lock_free);
inline constexpr std::size_t slot_head_bytes = 64;

constexpr std::size_t stride(std::uint32_t slot_bytes) {
  return (slot_head_bytes + slot_bytes + page_bytes - 1) / page_bytes * page_bytes;
}
constexpr std::size_t total_bytes(std::uint32_t slot_count, std::uint32_t slot_bytes) {
  return page_bytes + slot_count * stride(slot_bytes);
}

}  // namespace handloft::net::ring
