#include "server-model/geometry/pair_sums.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace handloft::geometry {

namespace {

// Points at a time: a cache line of doubles, the widest registers there are.
constexpr std::size_t octet = 8;
using Octet = double __attribute__((vector_size(octet * sizeof(double))));
using OctetMask = std::int64_t __attribute__((vector_size(octet * sizeof(std::int64_t))));

// exp(-2 s) = exp(-2 s0) exp(t), t = -2 (s - s0), by Taylor's polynomial of the second factor. Over a short
// span, |t| <= 0.25, degree 7 leaves 0.25^8 / 8! = 3.8e-10 at the edges; degree 12 leaves e / 13! = 4.4e-10,
// times exp(-1), over all of 0..1.
constexpr int short_degree = 7;
constexpr int full_degree = 12;
constexpr double short_span = 0.25;

// From the highest power down: 1 / degree! .. 1 / 0!.
template <int degree>
constexpr auto taylor = [] {
  std::array<double, degree + 1> result{};
  double factorial = 1;
  for (int i = 0; i <= degree; ++i) {
    if (i > 0) factorial *= i;
    result[static_cast<std::size_t>(degree - i)] = 1 / factorial;
  }
  return result;
}();

struct Job {
  const double* points;  // Three a point.
  std::size_t count;
  ContactArrays contacts;
  double squared_range;
  double scale, shift, gain, drop;  // t = scale d^2 + shift, eta = gain exp(t) - drop
  const double* coefficients;
  int degree;
  Falloff falloff;
  double* sums;  // Four a point.
};

#define HANDLOFT_TARGET
#define HANDLOFT_LOOP add_on_any
#include "server-model/geometry/pair_sums_loop.inc"
#undef HANDLOFT_LOOP
#undef HANDLOFT_TARGET

#if defined(__x86_64__)
#define HANDLOFT_TARGET __attribute__((target("avx2")))
#define HANDLOFT_LOOP add_on_avx2
#include "server-model/geometry/pair_sums_loop.inc"
#undef HANDLOFT_LOOP
#undef HANDLOFT_TARGET

#define HANDLOFT_TARGET __attribute__((target("avx512f,avx512dq")))
#define HANDLOFT_LOOP add_on_avx512
#include "server-model/geometry/pair_sums_loop.inc"
#undef HANDLOFT_LOOP
#undef HANDLOFT_TARGET
#endif

using Loop = void (*)(const Job&);

Loop widest_loop() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq")) return add_on_avx512;
  if (__builtin_cpu_supports("avx2")) return add_on_avx2;
#endif
  return add_on_any;
}

}  // namespace

void add_pair_sums(std::span<const Vec3> points, const ContactArrays& contacts, double squared_range,
                   const SquareSpan& squares, Falloff falloff, std::span<Quad> sums) {
  static const Loop loop = widest_loop();
  static_assert(sizeof(Vec3) == 3 * sizeof(double) && sizeof(Quad) == 4 * sizeof(double));
  if (points.empty()) return;
  const double low = std::clamp(squares.least, 0.0, 1.0), high = std::clamp(squares.largest, 0.0, 1.0);
  const bool is_short = falloff_rate * 0.5 * (high - low) <= short_span;
  const double middle = is_short ? 0.5 * (low + high) : 0.5;
  loop({.points = points.front().data(),
        .count = points.size(),
        .contacts = contacts,
        .squared_range = squared_range,
        .scale = -falloff_rate / squared_range,
        .shift = falloff_rate * middle,
        .gain = std::exp(-falloff_rate * middle) / (1 - falloff_beta),
        .drop = falloff_beta / (1 - falloff_beta),
        .coefficients = is_short ? taylor<short_degree>.data() : taylor<full_degree>.data(),
        .degree = is_short ? short_degree : full_degree,
        .falloff = falloff,
        .sums = reinterpret_cast<double*>(sums.data())});
}

}  // namespace handloft::geometry
