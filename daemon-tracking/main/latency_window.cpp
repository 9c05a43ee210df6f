#include "daemon-tracking/main/latency_window.h"

#include <algorithm>
#include <cmath>

namespace handloft::tracking {

void LatencyHistogram::add(double value_ms) {
  for (std::size_t i = 0; i < bounds_ms.size(); ++i)
    if (value_ms <= bounds_ms[i]) ++up_to[i];
  ++up_to.back();
  sum_ms += value_ms;
}

void LatencyWindow::forget(TimePoint now) {
  while (!values_.empty() && (now - values_.front().time > length_ || values_.size() > capacity))
    values_.pop_front();
}

void LatencyWindow::add(TimePoint now, double value_ms) {
  if (!std::isfinite(value_ms)) return;
  values_.push_back({now, value_ms});
  histogram_.add(value_ms);
  forget(now);
}

LatencyPercentiles LatencyWindow::at(TimePoint now) {
  forget(now);
  LatencyPercentiles out;
  out.frames = values_.size();
  if (values_.empty()) return out;
  std::vector<double> sorted;
  sorted.reserve(values_.size());
  for (const Value& value : values_) sorted.push_back(value.ms);
  std::sort(sorted.begin(), sorted.end());
  const auto nearest_rank = [&](double fraction) {
    const auto rank = static_cast<std::size_t>(std::ceil(fraction * static_cast<double>(sorted.size())));
    return sorted[std::max<std::size_t>(rank, 1) - 1];
  };
  out.p50_ms = nearest_rank(0.50);
  out.p95_ms = nearest_rank(0.95);
  out.p99_ms = nearest_rank(0.99);
  return out;
}

}  // namespace handloft::tracking
