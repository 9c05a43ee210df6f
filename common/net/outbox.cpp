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
  const bool state = key.lane == Lane::states;
  const std::size_t max_slots = state ? limits_.max_slots : limits_.max_notices;
  const std::size_t max_bytes = state ? limits_.max_slot_bytes : limits_.max_notice_bytes;
  Filled& lane = filled(key.lane);
  const auto found = slots_.find(key);
  const std::size_t replaced_size = found == slots_.end() ? 0 : found->second.frame->size();
  if (lane.bytes - replaced_size + size > max_bytes) return false;
  if (found != slots_.end()) {
    found->second.frame = std::move(frame);
    ++replaced_;
  } else {
    if (lane.slots >= max_slots) return false;
    ++lane.slots;
    slot_order_.emplace(next_order_, key);
    slots_.emplace(std::move(key), Slot{next_order_, std::move(frame)});
    ++next_order_;
  }
  lane.bytes += size - replaced_size;
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
  Filled& lane = filled(slot->first.lane);
  lane.bytes -= frame->size();
  --lane.slots;
  slots_.erase(slot);
  slot_order_.erase(first);
  return frame;
}

std::size_t Outbox::next_bytes() const {
  if (!queue_.empty()) return queue_.front()->size();
  return slot_order_.empty() ? 0 : slots_.at(slot_order_.begin()->second).frame->size();
}

std::optional<Outbox::Together> Outbox::take_together(std::size_t most_bytes) {
  const bool answers = has_answers();
  std::optional<Frame> first = take();
  if (!first) return std::nullopt;
  Together result{std::move(*first)};
  std::string all;
  while (!empty() && has_answers() == answers) {
    const std::size_t before = all.empty() ? result.bytes->size() : all.size();
    if (before + next_bytes() > most_bytes) break;
    if (all.empty()) all = *result.bytes;
    all += **take();
    ++result.frames;
  }
  if (!all.empty()) result.bytes = std::make_shared<const std::string>(std::move(all));
  return result;
}

void Outbox::clear() {
  queue_.clear();
  slots_.clear();
  slot_order_.clear();
  queued_bytes_ = 0;
  states_ = notices_ = Filled{};
}

}  // namespace handloft::net
