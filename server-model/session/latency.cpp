#include "server-model/session/latency.h"

#include <algorithm>
#include <cmath>

namespace handloft::session {
namespace {

constexpr double bin_ratio = 1.05;
constexpr double first_bin_ns = 1e3;
constexpr double ns_per_ms = 1e6;

}  // namespace

void LatencyHistogram::add(Duration duration) {
  const double ns = std::max(0.0, static_cast<double>(duration.count()));
  const double bin = ns <= first_bin_ns ? 0.0 : std::ceil(std::log(ns / first_bin_ns) / std::log(bin_ratio));
  ++bins_[std::min(bin_count - 1, static_cast<std::size_t>(bin))];
  ++count_;
  max_ = std::max(max_, duration);
}

LatencySummary LatencyHistogram::summary() const {
  LatencySummary result;
  result.count = count_;
  result.max_ms = static_cast<double>(max_.count()) / ns_per_ms;
  const auto quantile = [&](double fraction) {
    const auto rank = static_cast<std::uint64_t>(std::ceil(fraction * static_cast<double>(count_)));
    std::uint64_t seen = 0;
    for (std::size_t i = 0; i < bin_count; ++i) {
      seen += bins_[i];
      if (seen >= rank && seen > 0) {
        return std::min(result.max_ms,
                        first_bin_ns * std::pow(bin_ratio, static_cast<double>(i)) / ns_per_ms);
      }
    }
    return 0.0;
  };
  result.median_ms = quantile(0.5);
  result.p99_ms = quantile(0.99);
  return result;
}

}  // namespace handloft::session
