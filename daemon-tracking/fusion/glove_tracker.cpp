#include "daemon-tracking/fusion/glove_tracker.h"

#include <algorithm>

#include "daemon-tracking/source/glove_report.h"

namespace handloft::tracking {

GloveTracker::GloveTracker(const GloveOptions& options)
    : options_(options), contacts_(options.debounce), gesture_(options.gesture_hold) {}

Status GloveTracker::consume(const GloveBytes& bytes) {
  const auto report = parse_glove_report(bytes.bytes);
  if (!report) return report.error();
  const TimePoint time = present_ ? std::max(bytes.arrival_time, last_report_) : bytes.arrival_time;
  if (!present_) force_count_ = 0;
  present_ = true;
  last_report_ = time;
  contacts_.feed(time, static_cast<std::uint8_t>(report->contacts & contact_all));
  gesture_.feed(time, contacts_);

  raw_force_ = report->force;
  forces_ = {forces_[1], forces_[2], report->force};
  if (++force_count_ == 1) forces_ = {report->force, report->force, report->force};
  force_count_ = std::min(force_count_, 3);
  auto sorted = forces_;
  std::sort(sorted.begin(), sorted.end());
  const double range = options_.force_full - options_.force_zero;
  pressure_ = range > 0.0 ? std::clamp((sorted[1] - options_.force_zero) / range, 0.0, 1.0) : 0.0;
  potentiometer_ = std::clamp(report->potentiometer / static_cast<double>(glove_analogue_max), 0.0, 1.0);
  raw_potentiometer_ = report->potentiometer;
  battery_percent_ = report->battery_percent;
  const bool pressing = pressure_ > (pressing_ ? options_.pressing_off : options_.pressing_on);
  if (pressing != pressing_) pressing_since_ = time;
  pressing_ = pressing;
  return {};
}

void GloveTracker::device_gone(TimePoint time) {
  if (!present_) return;
  present_ = false;
  contacts_.release_all(time);
  gesture_.clear(time);
  if (pressing_) pressing_since_ = time;
  pressing_ = false;
  pressure_ = 0.0;
  raw_force_ = 0;
  force_count_ = 0;
}

void GloveTracker::advance(TimePoint time) {
  if (!present_) return;
  if (time - last_report_ > options_.silent_after) {
    device_gone(time);
    return;
  }
  contacts_.advance(time);
  gesture_.feed(time, contacts_);
}

void GloveTracker::describe(FusedHand& hand) const {
  hand.glove_present = present_;
  hand.gesture = gesture_.gesture();
  hand.gesture_since = gesture_.since();
  hand.pressure = pressure_;
  hand.raw_force = raw_force_;
  hand.pressing = pressing_;
  hand.pressing_since = pressing_since_;
  hand.potentiometer = potentiometer_;
  hand.raw_potentiometer = raw_potentiometer_;
  hand.battery_percent = battery_percent_;
  hand.contacts = contacts_.bits();
  hand.table_by_contact = (contacts_.bits() & contact_table) != 0;
}

}  // namespace handloft::tracking
