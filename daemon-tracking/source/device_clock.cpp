#include "daemon-tracking/source/device_clock.h"

#include <algorithm>
#include <vector>

namespace handloft::tracking {

namespace {
// Two spans' minima lie a second apart and are good to some 0.1 ms: a slope of three or more means something.
constexpr std::size_t spans_for_a_slope = 4;
}  // namespace

void DeviceClock::reset() {
  started_ = false;
}

void DeviceClock::begin(std::uint32_t device_us, TimePoint arrival) {
  started_ = true;
  last_us_ = device_us;
  device_us_ = 0;
  first_arrival_ = arrival;
  last_mapped_ = arrival;
  last_arrival_ = arrival;
  span_total_ = 0;
  current_ = Quickest{};
  current_began_s_ = 0.0;
  skew_ = 0.0;
  offset_s_ = 0.0;
}

TimePoint DeviceClock::map(std::uint32_t device_us, TimePoint arrival) {
  if (!started_) {
    begin(device_us, arrival);
    return arrival;
  }
  arrival = std::max(arrival, last_arrival_);
  // A difference in unsigned arithmetic goes over the wrap; a negative one is no time at all.
  const std::uint32_t step_us = device_us - last_us_;
  const double step_s = 1e-6 * static_cast<double>(step_us);
  const double arrival_step_s = to_seconds(arrival - last_arrival_);
  const double max_delay_s = to_seconds(options_.max_delay);
  if (step_us == 0 || step_s > arrival_step_s + max_delay_s) {
    // Stands still, ran backwards or jumped ahead: arrival is the best that is known.
    const TimePoint previous = last_mapped_;
    if (step_us != 0) ++resets_;
    begin(device_us, arrival);
    last_mapped_ = std::max(previous, arrival);
    return last_mapped_;
  }
  last_us_ = device_us;
  last_arrival_ = arrival;
  device_us_ += step_us;
  const double device_s = 1e-6 * static_cast<double>(device_us_);
  const Quickest seen{device_s, to_seconds(arrival - first_arrival_) - device_s};

  if (device_s - current_began_s_ >= to_seconds(options_.span)) {
    if (current_) spans_[span_total_++ % span_count] = *current_;
    current_.reset();
    current_began_s_ = device_s;
    fit();
  }
  if (!current_ || seen.offset_s < current_->offset_s) {
    current_ = seen;
    // Quicker than all before: the line is lowered at once.
    offset_s_ = std::min(offset_s_, seen.offset_s - skew_ * device_s);
  }
  const double delay_s = seen.offset_s - (skew_ * device_s + offset_s_);
  if (delay_s > max_delay_s) {
    const TimePoint previous = last_mapped_;
    ++resets_;
    begin(device_us, arrival);
    last_mapped_ = std::max(previous, arrival);
    return last_mapped_;
  }
  last_mapped_ = std::clamp(arrival - from_seconds(std::max(delay_s, 0.0)), last_mapped_, arrival);
  return last_mapped_;
}

void DeviceClock::fit() {
  const std::size_t count = std::min(span_total_, span_count);
  if (count >= spans_for_a_slope) {
    // Theil and Sen: the median of all slopes does not mind single spans in which every arrival was late.
    std::vector<double> slopes;
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const double apart = spans_[i].device_s - spans_[j].device_s;
        if (apart != 0.0) slopes.push_back((spans_[i].offset_s - spans_[j].offset_s) / apart);
      }
    }
    if (!slopes.empty()) {
      const auto middle = slopes.begin() + static_cast<std::ptrdiff_t>(slopes.size() / 2);
      std::nth_element(slopes.begin(), middle, slopes.end());
      skew_ = std::clamp(*middle, -options_.max_skew, options_.max_skew);
    }
  }
  if (count == 0) return;
  offset_s_ = spans_[0].offset_s - skew_ * spans_[0].device_s;
  for (std::size_t i = 1; i < count; ++i)
    offset_s_ = std::min(offset_s_, spans_[i].offset_s - skew_ * spans_[i].device_s);
}

}  // namespace handloft::tracking
