#pragma once
// How many TLS handshakes a server begins in a second (A1): each costs it a signature and a key agreement
// before it knows anything of the peer. Token buckets (RFC 2697's idea), one for all and one of each address.
// A part of the common one is kept for addresses that were quiet, so that newcomers do not wait behind a
// crowd.

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>

namespace handloft::net {

struct HandshakeRates {
  std::uint32_t per_s = 200;             ///< Of all together; 0: any number.
  std::uint32_t per_s_per_address = 30;  ///< Of one address (limited_address()); 0: any number.
};

/// Not thread-safe.
class HandshakeBudget {
 public:
  using Time = std::chrono::steady_clock::time_point;

  explicit HandshakeBudget(HandshakeRates rates) : rates_(rates) { all_.tokens = burst(rates.per_s); }

  /// Whether one of that address may begin now; then it is counted.
  bool take(const std::string& address, Time now);
  void set_rates(HandshakeRates rates) { rates_ = rates; }
  /// Addresses that are remembered: those that were not quiet lately.
  std::size_t remembered() const { return addresses_.size(); }

 private:
  struct Bucket {
    double tokens = 0.0;
    Time at{};
    bool used = false;
  };
  /// What may come at once after a quiet time: two seconds' worth.
  static double burst(std::uint32_t per_s);
  static void fill(Bucket& bucket, std::uint32_t per_s, Time now);
  Bucket& of_address(const std::string& address, Time now);

  HandshakeRates rates_;
  Bucket all_;
  std::map<std::string, Bucket> addresses_;
};

}  // namespace handloft::net
