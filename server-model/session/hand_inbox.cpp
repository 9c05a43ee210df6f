#include "server-model/session/hand_inbox.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace handloft::session {

HandInboxStatistics& HandInboxStatistics::operator+=(const HandInboxStatistics& other) {
  frames += other.frames;
  replaced += other.replaced;
  left_out += other.left_out;
  return *this;
}

bool HandInbox::Look::in_gesture() const {
  return mouse_moves || std::any_of(hands.begin(), hands.end(), [](const Hand& hand) {
           return hand.pressing || hand.gesture == v1::GESTURE_CLOSED;
         });
}

HandInbox::Look HandInbox::look_of(const v1::TrackingFrame& frame) {
  Look look;
  const std::size_t count = std::min(look.hands.size(), static_cast<std::size_t>(frame.hands_size()));
  for (std::size_t i = 0; i < count; ++i) {
    const v1::HandState& hand = frame.hands(static_cast<int>(i));
    const bool seen = std::any_of(
        hand.fingertip_states().begin(), hand.fingertip_states().end(),
        [](int state) { return state != v1::TRACKING_LOST && state != v1::TRACKING_STATE_UNSPECIFIED; });
    look.hands[i] = {seen, hand.gesture(), hand.pressing(), hand.contacts()};
  }
  const auto moves = [](const v1::Vec3& v) { return v.x() != 0 || v.y() != 0 || v.z() != 0; };
  look.mouse_moves = moves(frame.space_mouse().translation()) || moves(frame.space_mouse().rotation());
  return look;
}

// A change may go into debt by as much as a burst: no hand can change that often, but a network may bring the
// changes of seconds at once.
bool HandInbox::spend(bool change, TimePoint now) {
  if (refilled_ && now > *refilled_) {
    const double seconds = std::chrono::duration<double>(now - *refilled_).count();
    tokens_ = std::min(options_.burst_frames, tokens_ + seconds * options_.max_frames_per_s);
  }
  if (!refilled_ || now > *refilled_) refilled_ = now;
  const double left = tokens_ - 1;
  if (left < (change ? -options_.burst_frames : 0.0)) return false;
  tokens_ = left;
  return true;
}

HandInbox::Taken HandInbox::push(v1::TrackingFrame frame, TimePoint now) {
  const Look look = look_of(frame);
  const std::lock_guard lock(mutex_);
  ++statistics_.frames;
  if (!spend(!last_ || *last_ != look, now)) {
    ++statistics_.left_out;
    return Taken::left_out;
  }
  last_ = look;
  const bool behind = waiting_.size() >= (look.in_gesture() ? options_.of_gesture : options_.few);
  const bool alike = !sealed_ && !waiting_.empty() && waiting_.back().look == look;
  if ((behind && alike) || (waiting_.size() >= options_.most && !waiting_.empty())) {
    waiting_.back() = {std::move(frame), look};
    ++statistics_.replaced;
    return Taken::replaced;
  }
  waiting_.push_back({std::move(frame), look});
  sealed_ = false;
  return Taken::waits;
}

void HandInbox::seal() {
  const std::lock_guard lock(mutex_);
  sealed_ = true;
}

std::optional<v1::TrackingFrame> HandInbox::pop() {
  const std::lock_guard lock(mutex_);
  if (waiting_.empty()) return std::nullopt;
  v1::TrackingFrame frame = std::move(waiting_.front().frame);
  waiting_.pop_front();
  return frame;
}

HandInboxStatistics HandInbox::statistics() const {
  const std::lock_guard lock(mutex_);
  return statistics_;
}

}  // namespace handloft::session
