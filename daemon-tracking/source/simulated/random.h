#pragma once
// Random numbers without state: a hash of (seed, stream, index), so that any frame can be made without those
// before it and the same seed gives the same bytes on every machine.

#include <cmath>
#include <cstdint>
#include <numbers>

namespace handloft::tracking {

/// The finaliser of splitmix64 (Steele, Lea, Flood 2014).
constexpr std::uint64_t mix_bits(std::uint64_t value) {
  value += 0x9E3779B97F4A7C15ull;
  value = (value ^ (value >> 30)) * 0xBF58476D1CE4E5B9ull;
  value = (value ^ (value >> 27)) * 0x94D049BB133111EBull;
  return value ^ (value >> 31);
}

constexpr std::uint64_t hash_bits(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) {
  return mix_bits(mix_bits(mix_bits(seed) ^ stream) ^ index);
}

/// Uniform in [0, 1).
constexpr double uniform(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) {
  return static_cast<double>(hash_bits(seed, stream, index) >> 11) * 0x1.0p-53;
}

/// Normal with mean 0 and standard deviation 1 (Box and Muller 1958).
inline double normal(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) {
  const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform(seed, stream, 2 * index)));
  return radius * std::cos(2.0 * std::numbers::pi * uniform(seed, stream, 2 * index + 1));
}

}  // namespace handloft::tracking
