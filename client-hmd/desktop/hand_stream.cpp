#include "client-hmd/desktop/hand_stream.h"

#include <algorithm>
#include <utility>

namespace handloft::client {
namespace {

/// FistOptions::steady_m and steady_for, and a bit: frames that the server would take a mean over.
constexpr double steady_m = 0.00101;
constexpr Duration steady_for = std::chrono::milliseconds(125);

bool is_fist(DesktopTool tool) {
  return tool == DesktopTool::push || tool == DesktopTool::move;
}

bool same_work(const HandPose& a, const HandPose& b) {
  return a.cursor == b.cursor && a.turn == b.turn && a.pressure == b.pressure &&
         a.potentiometer == b.potentiometer;
}

}  // namespace

void HandStream::connected_anew() {
  modes_ = Modes();
  messages_.clear();
  tool_.reset();
  pen_in_hand_ = false;
  sent_.reset();
  waiting_.reset();
  cancelled_at_.reset();
}

bool HandStream::is_pen() const {
  return tool_ == DesktopTool::draw || tool_ == DesktopTool::trim || tool_ == DesktopTool::region;
}

// Every frame costs, and state changes are told even into debt.
TimePoint HandStream::later(TimePoint time) {
  const TimePoint next = std::max(time, last_time_ + std::chrono::microseconds(1));
  const double gained = to_seconds(next - last_time_) * options_.frames_per_s;
  tokens_ = std::min(options_.burst_frames, tokens_ + gained) - 1.0;
  last_time_ = next;
  return next;
}

bool HandStream::affords(TimePoint time) const {
  return tokens_ + to_seconds(time - last_time_) * options_.frames_per_s >= 1.0;
}

// A fist within its first moments at its first place: the server would take a mean over what is told now.
bool HandStream::settling(TimePoint time, const glm::dvec3& at) const {
  return tool_ && is_fist(*tool_) && sent_ && sent_->time == began_ && turn_ == sent_->turn &&
         glm::distance(at, began_at_) <= steady_m && time - began_ < steady_for;
}

HandPose HandStream::pose_at(TimePoint time, const glm::dvec3& at, const HandTouch& touch) const {
  HandPose pose;
  pose.time = time;
  pose.gesture = gesture_;
  pose.cursor = at;
  pose.direction = direction_;
  pose.turn = turn_;
  pose.pressing = gesture_ != v1::GESTURE_CLOSED;
  pose.pressure = touch.pressure;
  pose.potentiometer = touch.potentiometer;
  return pose;
}

void HandStream::send(HandPose pose) {
  pose.time = later(pose.time);
  HandPose told = pose;
  if (pose.gesture == v1::GESTURE_CLOSED) told.turn = told_turn(pose.turn);
  messages_.emplace_back(hand_frame(told, ++sequence_));
  sent_ = pose;
  waiting_.reset();
}

void HandStream::command(PaletteCommand command) {
  messages_.emplace_back(command);
  switch (command) {
    case PaletteCommand::move:
      modes_.move = !modes_.move;
      break;
    case PaletteCommand::trim_mode:
      modes_.boundary = !modes_.boundary;
      modes_.move = false;
      break;
    case PaletteCommand::icon_pen:
      modes_.region = !modes_.region;
      break;
    default:
      break;
  }
}

void HandStream::set_modes(DesktopTool tool) {
  const bool boundary = tool == DesktopTool::trim;
  const bool region = tool == DesktopTool::region;
  const bool pen = boundary || region || tool == DesktopTool::draw;
  if (pen && modes_.boundary != boundary) command(PaletteCommand::trim_mode);
  if (pen && !boundary && modes_.region != region) command(PaletteCommand::icon_pen);
  const bool moving = tool == DesktopTool::move;
  if (tool != DesktopTool::lay && modes_.move != moving) command(PaletteCommand::move);
}

void HandStream::hover(TimePoint time, const glm::dvec3& at, const HandTouch& touch) {
  HandPose pose;
  pose.time = time;
  pose.gesture = pen_in_hand_ ? v1::GESTURE_POINTING : v1::GESTURE_OPEN;
  pose.cursor = at;
  pose.pressure = touch.pressure;
  pose.potentiometer = touch.potentiometer;
  hover_ = pose;
}

void HandStream::send_hover(TimePoint time) {
  if (!hover_) return;
  HandPose pose = *hover_;
  pose.time = time;
  pose.gesture = pen_in_hand_ ? v1::GESTURE_POINTING : v1::GESTURE_OPEN;
  send(pose);
}

void HandStream::send_no_hand(TimePoint time) {
  messages_.emplace_back(no_hand_frame(later(time), ++sequence_));
}

void HandStream::leave(TimePoint time) {
  hover_.reset();
  if (tool_ || !std::exchange(sent_, std::nullopt)) return;
  send_no_hand(time);
}

void HandStream::begin(DesktopTool tool, TimePoint time, const glm::dvec3& at, const glm::dvec3& direction,
                       const HandTouch& touch) {
  if (tool_ || cancelled_at_) return;
  if (pen_in_hand_ && (is_fist(tool) || tool == DesktopTool::lay)) put_down(time);
  if (!pen_in_hand_) set_modes(tool);
  direction_ = direction;
  turn_ = glm::dquat(1.0, 0.0, 0.0, 0.0);
  began_at_ = at;
  tool_ = tool;
  gesture_ = v1::GESTURE_POINTING;
  if (tool == DesktopTool::lay) gesture_ = v1::GESTURE_OPEN;
  if (is_fist(tool)) {
    gesture_ = v1::GESTURE_CLOSED;
    // The open hand comes first, so that the server knows what it is about to close round.
    hover(time, at, touch);
    send_hover(time);
  }
  pen_in_hand_ = is_pen();
  send(pose_at(time, at, touch));
  began_ = last_time_;
}

void HandStream::move(TimePoint time, const glm::dvec3& at, const HandTouch& touch) {
  if (!tool_ || !sent_) return;
  waiting_ = pose_at(time, at, touch);
  const bool far_enough = glm::distance(at, sent_->cursor) >= options_.step_m;
  if (far_enough && affords(time) && !settling(time, at)) send(*waiting_);
}

void HandStream::turn(TimePoint time, const glm::dquat& turn) {
  if (!tool_ || !sent_ || !is_fist(*tool_)) return;
  turn_ = turn;
  HandPose pose = waiting_ ? *waiting_ : *sent_;
  pose.time = time;
  pose.turn = turn;
  waiting_ = pose;
}

void HandStream::tap_thumb(TimePoint time) {
  if (!tool_ || !is_pen() || !sent_) return;
  HandPose pose = waiting_ ? *waiting_ : *sent_;
  pose.time = time;
  pose.thumb_laid = true;
  send(pose);
  pose.thumb_laid = false;
  send(pose);
}

void HandStream::flush(TimePoint time) {
  if (cancelled_at_) {
    send_no_hand(time);
    if (time - *cancelled_at_ < options_.cancel_after) return;
    cancelled_at_.reset();
  }
  if (tool_) {
    if (!waiting_ || !sent_ || settling(time, waiting_->cursor) || !affords(time)) return;
    if (same_work(*waiting_, *sent_)) {
      waiting_.reset();
      return;
    }
    // Sent as of now: one that waited out the fist's first moments must not lie within them.
    waiting_->time = std::max(waiting_->time, time);
    send(*waiting_);
    return;
  }
  if (!hover_) return;
  const bool first = !sent_;
  const Duration since = first ? options_.rest_interval : time - last_time_;
  const bool moved = first || !same_work(*hover_, *sent_) || sent_->pressing;
  if (since >= (moved ? options_.hover_interval : options_.rest_interval)) send_hover(time);
}

void HandStream::end(TimePoint time, const glm::dvec3& at, const HandTouch& touch, Ending ending) {
  if (!tool_ || !sent_) {
    tool_.reset();
    return;
  }
  // A fist that has gone nowhere is not told a place nearby: what it drags would move by less than was seen.
  const bool fist = is_fist(*tool_);
  const bool went = !fist || glm::distance(at, began_at_) > steady_m || turn_ != sent_->turn;
  const HandPose last = pose_at(time, at, touch);
  if (went && !same_work(last, *sent_)) {
    send(last);
  } else if (waiting_ && went) {
    send(*waiting_);
  }
  waiting_.reset();
  const bool pen = is_pen();
  tool_.reset();
  hover(time, at, touch);
  hover_->direction = direction_;
  gesture_ = v1::GESTURE_OPEN;
  if (pen) {
    pen_in_hand_ = true;
    send_hover(time);  // Lifted,
    if (ending == Ending::more) return;
    pen_in_hand_ = false;
  }
  send_hover(time);  // and put down.
}

void HandStream::put_down(TimePoint time) {
  if (!std::exchange(pen_in_hand_, false) || tool_) return;
  send_hover(time);
}

void HandStream::cancel(TimePoint time) {
  if (!tool_ && !pen_in_hand_) return;
  tool_.reset();
  pen_in_hand_ = false;
  waiting_.reset();
  sent_.reset();
  gesture_ = v1::GESTURE_OPEN;
  send_no_hand(time);
  cancelled_at_ = last_time_;
}

std::vector<HandMessage> HandStream::take() {
  return std::exchange(messages_, {});
}

}  // namespace handloft::client
