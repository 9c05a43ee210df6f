#include "daemon-tracking/fusion/glove_tracker.h"

#include <algorithm>

#include "daemon-tracking/source/glove_report.h"

namespace handloft::tracking {

namespace {

constexpr int table_pad = 5;
static_assert(contact_table == 1u << table_pad);

double part_of(std::uint16_t value, std::uint16_t low, std::uint16_t high) {
  if (high <= low) return 0.0;
  return std::clamp((static_cast<double>(value) - low) / (static_cast<double>(high) - low), 0.0, 1.0);
}

}  // namespace

GloveTracker::GloveTracker(const GloveOptions& options)
    : options_(options),
      clock_(options.clock),
      serial_(options.serial),
      contacts_(options.debounce),
      gesture_(options.gesture_hold) {}

Status GloveTracker::consume(const GloveBytes& bytes) {
  if (!bytes.bytes.empty() && bytes.bytes.front() == glove_range_id) {
    const auto range = parse_glove_range(bytes.bytes);
    if (!range) {
      ++counters_.refused;
      return range.error();
    }
    device_range_ = *range;
    return {};
  }
  const auto report = parse_glove_report(bytes.bytes);
  if (!report) {
    ++counters_.refused;
    return report.error();
  }
  count_lost(*report);
  if ((report->flags & glove_restarted) != 0) clock_.reset();
  use(*report, clock_.map(report->device_time_us, bytes.arrival_time));
  return {};
}

Status GloveTracker::consume(const DeviceBytes& bytes) {
  const auto line = parse_serial_glove_line(bytes.bytes);
  if (!line) {
    ++counters_.refused;
    return line.error();
  }
  use(serial_.map(*line), bytes.arrival_time);
  return {};
}

void GloveTracker::count_lost(const GloveReport& report) {
  if (sequence_ && (report.flags & glove_restarted) == 0)
    counters_.lost += static_cast<std::uint16_t>(report.sequence - *sequence_ - 1);
  sequence_ = report.sequence;
}

GloveRange GloveTracker::range() const {
  if (options_.range_from == GloveRangeFrom::device_first && device_range_ && device_range_->calibrated)
    return *device_range_;
  const auto raw = [](double value) {
    return static_cast<std::uint16_t>(std::clamp(value, 0.0, static_cast<double>(glove_analogue_max)));
  };
  return {raw(options_.force_zero), raw(options_.force_full), raw(options_.potentiometer_low),
          raw(options_.potentiometer_high), false};
}

void GloveTracker::use(const GloveReport& report, TimePoint report_time) {
  const TimePoint time = present_ ? std::max(report_time, last_report_) : report_time;
  if (!present_) force_count_ = 0;
  present_ = true;
  last_report_ = time;
  ++counters_.reports;
  contacts_.feed(time, static_cast<std::uint8_t>(report.contacts & contact_all));
  gesture_.feed(time, contacts_);

  raw_force_ = report.force;
  forces_ = {forces_[1], forces_[2], report.force};
  if (++force_count_ == 1) forces_ = {report.force, report.force, report.force};
  force_count_ = std::min(force_count_, 3);
  auto sorted = forces_;
  std::sort(sorted.begin(), sorted.end());
  const GloveRange scale = range();
  pressure_ = part_of(sorted[1], scale.force_zero, scale.force_full);
  potentiometer_ = part_of(report.potentiometer, scale.potentiometer_low, scale.potentiometer_high);
  raw_potentiometer_ = report.potentiometer;
  battery_percent_ = report.battery_percent;
  const bool pressing = pressure_ > (pressing_ ? options_.pressing_off : options_.pressing_on);
  if (pressing != pressing_) pressing_since_ = time;
  pressing_ = pressing;
}

void GloveTracker::device_gone(TimePoint time) {
  device_range_.reset();  // The next one may be another glove.
  sequence_.reset();
  let_go(time);
}

void GloveTracker::let_go(TimePoint time) {
  if (!present_) return;
  present_ = false;
  contacts_.release_all(time);
  gesture_.clear(time);
  if (pressing_) pressing_since_ = time;
  pressing_ = false;
  pressure_ = 0.0;
  raw_force_ = 0;
  force_count_ = 0;
  clock_.reset();
  serial_.reset();
}

GloveCounters GloveTracker::counters() const {
  GloveCounters out = counters_;
  out.bounces = contacts_.bounces();
  out.clock_resets = clock_.resets();
  return out;
}

void GloveTracker::advance(TimePoint time) {
  if (!present_) return;
  if (time - last_report_ > options_.silent_after) {
    let_go(time);
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
  hand.table_since = contacts_.changed(table_pad);
}

}  // namespace handloft::tracking
