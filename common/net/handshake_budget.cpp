#include "common/net/handshake_budget.h"

#include <algorithm>
#include <iterator>

namespace handloft::net {

namespace {
constexpr double burst_s = 2.0;
/// Of the common bucket, for addresses that were quiet.
constexpr double kept_for_newcomers = 0.25;
/// Beyond, those that nobody remembers share one bucket.
constexpr std::size_t most_addresses = 4096;
}  // namespace

double HandshakeBudget::burst(std::uint32_t per_s) {
  return std::max(1.0, burst_s * per_s);
}

void HandshakeBudget::fill(Bucket& bucket, std::uint32_t per_s, Time now) {
  if (!bucket.used) {
    bucket = {burst(per_s), now, true};
    return;
  }
  const double passed = std::max(0.0, std::chrono::duration<double>(now - bucket.at).count());
  bucket.tokens = std::min(burst(per_s), bucket.tokens + passed * per_s);
  bucket.at = now;
}

HandshakeBudget::Bucket& HandshakeBudget::of_address(const std::string& address, Time now) {
  if (const auto found = addresses_.find(address); found != addresses_.end()) return found->second;
  if (addresses_.size() >= most_addresses) {
    for (auto it = addresses_.begin(); it != addresses_.end();) {
      fill(it->second, rates_.per_s_per_address, now);
      const bool quiet = it->second.tokens >= burst(rates_.per_s_per_address);
      it = quiet ? addresses_.erase(it) : std::next(it);
    }
  }
  return addresses_[addresses_.size() < most_addresses ? address : std::string()];
}

bool HandshakeBudget::take(const std::string& address, Time now) {
  bool quiet = false;
  if (rates_.per_s_per_address > 0) {
    Bucket& own = of_address(address, now);
    fill(own, rates_.per_s_per_address, now);
    quiet = own.tokens >= burst(rates_.per_s_per_address);
    if (own.tokens < 1) return false;
    own.tokens -= 1;  // Whatever comes of it: who tries again and again is not quiet.
  }
  if (rates_.per_s > 0) {
    fill(all_, rates_.per_s, now);
    const double kept = quiet ? 0.0 : kept_for_newcomers * burst(rates_.per_s);
    if (all_.tokens - kept < 1) return false;
    all_.tokens -= 1;
  }
  return true;
}

}  // namespace handloft::net
