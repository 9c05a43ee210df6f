#include "common/base/histogram.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <string>

namespace handloft {

namespace {
constexpr double ns_per_s = 1e9;
}  // namespace

void Histogram::add(Duration duration) {
  const auto ns =
      std::max<std::int64_t>(0, std::chrono::duration_cast<std::chrono::nanoseconds>(duration).count());
  const double seconds = static_cast<double>(ns) / ns_per_s;
  const auto bin = static_cast<std::size_t>(std::lower_bound(bounds_s.begin(), bounds_s.end(), seconds) -
                                            bounds_s.begin());
  bins_[bin].fetch_add(1, std::memory_order_relaxed);
  sum_ns_.fetch_add(ns, std::memory_order_relaxed);
  count_.fetch_add(1, std::memory_order_relaxed);
}

void Histogram::write(MetricsText& text, std::string_view labels) const {
  const std::string before = labels.empty() ? std::string() : std::string(labels) + ",";
  std::uint64_t below = 0;
  for (std::size_t i = 0; i < bounds_s.size(); ++i) {
    below += bins_[i].load(std::memory_order_relaxed);
    text.sample(below, fmt::format("{}le=\"{}\"", before, bounds_s[i]), "_bucket");
  }
  // The buckets' own sum, so that they agree with each other whatever is added meanwhile.
  const std::uint64_t all = below + bins_.back().load(std::memory_order_relaxed);
  text.sample(all, before + "le=\"+Inf\"", "_bucket");
  text.sample(static_cast<double>(sum_ns_.load(std::memory_order_relaxed)) / ns_per_s, labels, "_sum");
  text.sample(all, labels, "_count");
}

}  // namespace handloft
