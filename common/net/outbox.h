#pragma once
// What waits to be written to one receiver, in bounded memory (architecture, idea 5; U4): four outboxes, each
// with a bound of its own, so that none takes another's room.
//
// Answers are a reliable queue; beyond its bound the receiver is let go or begins anew (ServerEvents). States
// are slots where a newer message replaces an unsent older one, as presence; beyond the bound one is dropped.
// Notices are the same, for what changes seldom and may be large, as who is there. The scene is asked for at
// the moment of writing ("pull"), so that it is composed from what this receiver has by then; nothing of it
// waits here.
//
// Not thread-safe: the connection locks around it.

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
  /// Of the reliable queue: a receiver this far behind is re-seeded or let go, not replayed.
  std::size_t max_queued_bytes = 8u << 20;
  std::size_t max_queued_frames = 4096;
  /// Of the states: slots are per person or per sensor; what comes with more keys than this is dropped.
  std::size_t max_slots = 4096;
  std::size_t max_slot_bytes = 32u << 20;
  std::size_t max_notices = 64;  ///< Kinds of them are few.
  std::size_t max_notice_bytes = 1u << 20;
};

enum class Lane : std::uint8_t { states, notices };

/// Which stream of states a slot belongs to; the key says which one of them (an entity, a client).
struct SlotKey {
  std::uint32_t kind = 0;
  std::string key;
  Lane lane = Lane::states;  ///< The same for all of a kind.
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
  struct Together {
    Frame bytes;  ///< Of all, one after the other.
    int frames = 1;
  };
  /// take(), and after it as many as follow it, answers or states, while all of them have at most
  /// `most_bytes`: small ones go with one write.
  std::optional<Together> take_together(std::size_t most_bytes);
  bool empty() const { return queue_.empty() && slots_.empty(); }
  /// take() gives one of the reliable queue.
  bool has_answers() const { return !queue_.empty(); }
  void clear();

  std::size_t queued_bytes() const { return queued_bytes_ + states_.bytes + notices_.bytes; }
  std::size_t queued_frames() const { return queue_.size() + slots_.size(); }
  /// Frames that a newer one of the same slot replaced.
  std::uint64_t replaced() const { return replaced_; }

 private:
  struct Slot {
    std::uint64_t order = 0;
    Frame frame;
  };
  struct Filled {
    std::size_t slots = 0;
    std::size_t bytes = 0;
  };
  std::size_t next_bytes() const;
  Filled& filled(Lane lane) { return lane == Lane::states ? states_ : notices_; }

  OutboxLimits limits_;
  std::deque<Frame> queue_;
  std::map<SlotKey, Slot> slots_;
  std::map<std::uint64_t, SlotKey> slot_order_;
  std::size_t queued_bytes_ = 0;
  Filled states_, notices_;
  std::uint64_t next_order_ = 0;
  std::uint64_t replaced_ = 0;
};

}  // namespace handloft::net
