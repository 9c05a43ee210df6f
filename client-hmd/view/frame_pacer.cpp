#include "client-hmd/view/frame_pacer.h"

#include <algorithm>

namespace handloft::client {
namespace {

constexpr Duration longest_part = std::chrono::seconds(1);

}  // namespace

void FramePacer::Longest::add(Duration duration) {
  durations_[next_] = duration;
  next_ = (next_ + 1) % window;
}

Duration FramePacer::Longest::get() const {
  return *std::max_element(durations_.begin(), durations_.end());
}

void FramePacer::set_period(std::optional<Duration> period) {
  if (period && *period <= Duration::zero()) period.reset();
  if (period == period_) return;
  period_ = period;
  last_swap_.reset();
  margin_ = options_.smallest_margin;
}

FramePlan FramePacer::plan(TimePoint now) const {
  if (!period_) {
    return {now, now, now, now + std::max(unpaced_latency_, scene_.last() + last_pass_.last())};
  }
  if (!last_swap_) return {now, now, now + *period_, now + *period_ + *period_ / 2};
  const Duration last = last_pass_.get() + margin_;
  const Duration whole = scene_.get() + last;
  // The first refresh that the frame can still make; one that has just been, not again.
  const Duration ahead = std::max(now + whole - *last_swap_, *period_ / 2);
  const auto periods = (ahead + *period_ - Duration(1)) / *period_;
  FramePlan plan;
  plan.refresh = *last_swap_ + std::max<std::int64_t>(periods, 1) * *period_;
  // A scene that takes longer than a refresh has no time to lose.
  plan.begin = whole > *period_ ? now : std::max(now, plan.refresh - whole);
  plan.latch = std::max(plan.begin, plan.refresh - last);
  plan.light = plan.refresh + *period_ / 2;
  return plan;
}

void FramePacer::drew(Duration scene, Duration last_pass) {
  const auto sane = [](Duration part) { return part >= Duration::zero() && part < longest_part; };
  if (!sane(scene) || !sane(last_pass)) return;
  scene_.add(scene);
  last_pass_.add(last_pass);
}

bool FramePacer::swapped(const FramePlan& plan, TimePoint time) {
  const bool knew = last_swap_.has_value();
  last_swap_ = time;
  if (!period_ || !knew) return false;
  const bool missed = time > plan.refresh + *period_ / 2;
  if (missed) {
    ++missed_;
    const auto grown = std::chrono::duration_cast<Duration>(margin_ * options_.margin_growth);
    margin_ = std::min(grown, std::max(*period_ / 2, options_.smallest_margin));
  } else {
    const Duration above = margin_ - options_.smallest_margin;
    margin_ -= std::chrono::duration_cast<Duration>(above * options_.margin_decay);
  }
  return missed;
}

}  // namespace handloft::client
