#include "common/net/outbox.h"

namespace handloft::net {

bool Outbox::push(Frame frame) {
  const std::size_t size = frame->size();
  if (queue_.size() >= limits_.max_queued_frames || queued_bytes_ + size > limits_.max_queued_bytes)
    return false;
  queued_bytes_ += size;
  queue_.push_back(std::move(frame));
  return true;
}

bool Outbox::put_latest(SlotKey key, Frame frame) {
  const std::size_t size = frame->size();
  const auto found = slots_.find(key);
  const std::size_t replaced_size = found == slots_.end() ? 0 : found->second.frame->size();
  if (slot_bytes_ - replaced_size + size > limits_.max_slot_bytes) return false;
  if (found != slots_.end()) {
    found->second.frame = std::move(frame);
    ++replaced_;
  } else {
    if (slots_.size() >= limits_.max_slots) return false;
    slot_order_.emplace(next_order_, key);
    slots_.emplace(std::move(key), Slot{next_order_, std::move(frame)});
    ++next_order_;
  }
  slot_bytes_ += size - replaced_size;
  return true;
}

std::optional<Frame> Outbox::take() {
  if (!queue_.empty()) {
    Frame frame = std::move(queue_.front());
    queue_.pop_front();
    queued_bytes_ -= frame->size();
    return frame;
  }
  if (slot_order_.empty()) return std::nullopt;
  const auto first = slot_order_.begin();
  const auto slot = slots_.find(first->second);
  Frame frame = std::move(slot->second.frame);
  slot_bytes_ -= frame->size();
  slots_.erase(slot);
  slot_order_.erase(first);
  return frame;
}

void Outbox::clear() {
  queue_.clear();
  slots_.clear();
  slot_order_.clear();
  queued_bytes_ = 0;
  slot_bytes_ = 0;
}

}  // namespace handloft::net
