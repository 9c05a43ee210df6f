#include "daemon-tracking/main/percentiles.h"

#include <algorithm>
#include <cmath>

namespace handloft::tracking {

void Percentiles::add(double value) {
  if (!std::isfinite(value)) return;
  if (count_++ % stride_ != 0) return;
  if (kept_.size() == capacity) {
    for (std::size_t i = 0; i < capacity / 2; ++i) kept_[i] = kept_[2 * i];
    kept_.resize(capacity / 2);
    stride_ *= 2;
    if ((count_ - 1) % stride_ != 0) return;
  }
  kept_.push_back(value);
}

double Percentiles::at(double fraction) const {
  if (kept_.empty()) return 0.0;
  std::vector<double> values = kept_;
  const double rank = std::clamp(fraction, 0.0, 1.0) * static_cast<double>(values.size() - 1);
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(std::llround(rank));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

}  // namespace handloft::tracking
