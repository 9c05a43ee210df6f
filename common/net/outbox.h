#pragma once
// What waits to be written to one receiver, in bounded memory (architecture, idea 5): a reliable queue, slots
// where a newer message replaces an unsent older one, and a question asked at the moment of writing ("pull"),
// so that what is sent is composed from what this receiver has by then. Not thread-safe: the connection locks
// around it.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "common/net/framing.h"

namespace handloft::net {

struct OutboxLimits {
  /// Of the reliable queue: a receiver this far behind is re-seeded, not replayed.
  std::size_t max_queued_bytes = 8u << 20;
  std::size_t max_queued_frames = 4096;
  /// Slots are per entity or per person; more keys than this are an overflow as well.
  std::size_t max_slots = 4096;
  std::size_t max_slot_bytes = 32u << 20;
};

/// Which stream of states a slot belongs to; the key says which one of them (an entity, a client).
struct SlotKey {
  std::uint32_t kind = 0;
  std::string key;
  auto operator<=>(const SlotKey&) const = default;
};

class Outbox {
 public:
  explicit Outbox(OutboxLimits limits = {}) : limits_(limits) {}

  /// False: a limit would be exceeded, and the frame was not taken.
  bool push(Frame frame);
  bool put_latest(SlotKey key, Frame frame);

  /// What to write next: the reliable queue first, then slots in the order in which they were first filled.
  std::optional<Frame> take();
  bool empty() const { return queue_.empty() && slots_.empty(); }
  void clear();

  std::size_t queued_bytes() const { return queued_bytes_ + slot_bytes_; }
  std::size_t queued_frames() const { return queue_.size() + slots_.size(); }
  /// Frames that a newer one of the same slot replaced.
  std::uint64_t replaced() const { return replaced_; }

 private:
  struct Slot {
    std::uint64_t order = 0;
    Frame frame;
  };
  OutboxLimits limits_;
  std::deque<Frame> queue_;
  std::map<SlotKey, Slot> slots_;
  std::map<std::uint64_t, SlotKey> slot_order_;
  std::size_t queued_bytes_ = 0;
  std::size_t slot_bytes_ = 0;
  std::uint64_t next_order_ = 0;
  std::uint64_t replaced_ = 0;
};

}  // namespace handloft::net
