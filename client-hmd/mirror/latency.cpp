#include "client-hmd/mirror/latency.h"

#include <algorithm>
#include <cmath>

namespace handloft::client {

void LatencyHistogram::add(Duration duration) {
  const double bin = std::max(to_seconds(duration), 0.0) * 1e3 * static_cast<double>(bins_per_ms);
  ++bins_[std::min(static_cast<std::size_t>(bin), bins_.size() - 1)];
  ++count_;
  longest_ = std::max(longest_, duration);
}

double LatencyHistogram::quantile_ms(double share) const {
  if (count_ == 0) return 0.0;
  const auto rank =
      static_cast<std::uint64_t>(std::ceil(std::clamp(share, 0.0, 1.0) * static_cast<double>(count_)));
  std::uint64_t seen = 0;
  for (std::size_t i = 0; i < bins_.size(); ++i) {
    seen += bins_[i];
    if (seen >= std::max<std::uint64_t>(rank, 1)) {
      return static_cast<double>(i + 1) / static_cast<double>(bins_per_ms);
    }
  }
  return static_cast<double>(bins_.size()) / static_cast<double>(bins_per_ms);
}

}  // namespace handloft::client
