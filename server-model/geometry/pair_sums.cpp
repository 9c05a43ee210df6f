#include "server-model/geometry/pair_sums.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

namespace handloft::geometry {

namespace {

// Points at a time: a cache line of doubles, the widest registers there are.
constexpr std::size_t octet = 8;
using Octet = double __attribute__((vector_size(octet * sizeof(double))));
using OctetMask = std::int64_t __attribute__((vector_size(octet * sizeof(std::int64_t))));

// How far the pairs of a call are within range: those of some boxes all are.
enum class Reach : unsigned char { partly, wholly };

// exp(-2 s) = exp(-2 s0) exp(t), t = -2 (s - s0), the second factor by its Chebyshev series up to a degree,
// which leaves about 2 I_(degree + 1)(h) for |t| <= h: less than 1e-9 up to these h. Boxes near each other
// span little, and a low degree is cheap.
struct Expansion {
  int degree;
  double half_span;
};
constexpr std::array<Expansion, 5> expansions = {{{4, 0.07}, {5, 0.165}, {6, 0.31}, {7, 0.51}, {9, 1.0}}};
constexpr std::size_t max_terms = 10;

// By expansion: the coefficients of 1, t, t^2 ...
using Coefficients = std::array<double, max_terms>;

// 2 I_n(h) (I_0(h) for n = 0), the Chebyshev coefficients of exp(h x), by the power series of the modified
// Bessel function.
double chebyshev_coefficient(int n, double h) {
  double term = 1;
  for (int i = 1; i <= n; ++i) term *= 0.5 * h / i;
  double sum = term;
  for (int i = 1; i <= 20; ++i) {
    term *= 0.25 * h * h / (i * (n + i));
    sum += term;
  }
  return n == 0 ? sum : 2 * sum;
}

Coefficients coefficients_of(const Expansion& expansion) {
  Coefficients sum{}, before{}, now{};  // Powers of x = t / h: of the sum so far, T_(n-1), T_n.
  now[0] = 1;
  for (int n = 0; n <= expansion.degree; ++n) {
    const double factor = chebyshev_coefficient(n, expansion.half_span);
    Coefficients next{};
    for (std::size_t k = 0; k < max_terms; ++k) {
      sum[k] += factor * now[k];
      next[k] = (n == 0 ? 1 : 2) * (k > 0 ? now[k - 1] : 0.0) - before[k];
    }
    before = now;
    now = next;
  }
  double power = 1;
  for (double& coefficient : sum) {
    coefficient *= power;
    power /= expansion.half_span;
  }
  return sum;
}

// Boxes that are closer together than this part of R^2 have all pairs in range, whatever rounding does.
constexpr double wholly_within = 1 - 1e-12;

struct Job {
  const double* points;  // Three a point.
  std::size_t count;
  ContactArrays contacts;
  double squared_range;
  double middle;              // eta is a polynomial of t = d^2 - middle
  Coefficients coefficients;  // of 1, t, t^2 ...
  double* sums;               // Four a point.
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
using ByExpansion = std::array<Loop, expansions.size()>;
using ByReach = std::array<ByExpansion, 2>;
using Loops = std::array<ByReach, 2>;  // By falloff.

// Each loop that `instance` gives for a falloff, a reach and a degree.
template <Falloff falloff, Reach reach, typename Instance, std::size_t... e>
constexpr ByExpansion by_expansion(Instance instance, std::index_sequence<e...>) {
  return {instance.template operator()<falloff, reach, expansions[e].degree>()...};
}
template <Falloff falloff, typename Instance>
constexpr ByReach by_reach(Instance instance) {
  constexpr auto all = std::make_index_sequence<expansions.size()>{};
  return {by_expansion<falloff, Reach::partly>(instance, all),
          by_expansion<falloff, Reach::wholly>(instance, all)};
}
template <typename Instance>
constexpr Loops all_loops(Instance instance) {
  return {by_reach<Falloff::literal>(instance), by_reach<Falloff::smooth>(instance)};
}

Loops widest_loops() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq")) {
    return all_loops([]<Falloff f, Reach r, int degree>() -> Loop { return add_on_avx512<f, r, degree>; });
  }
  if (__builtin_cpu_supports("avx2")) {
    return all_loops([]<Falloff f, Reach r, int degree>() -> Loop { return add_on_avx2<f, r, degree>; });
  }
#endif
  return all_loops([]<Falloff f, Reach r, int degree>() -> Loop { return add_on_any<f, r, degree>; });
}

struct Tables {
  Loops loops = widest_loops();
  std::array<Coefficients, expansions.size()> coefficients{};
  Tables() {
    for (std::size_t i = 0; i < expansions.size(); ++i) coefficients[i] = coefficients_of(expansions[i]);
  }
};

}  // namespace

void add_pair_sums(std::span<const Vec3> points, const ContactArrays& contacts, double squared_range,
                   const SquareSpan& squares, Falloff falloff, std::span<Quad> sums) {
  static const Tables tables;
  static_assert(sizeof(Vec3) == 3 * sizeof(double) && sizeof(Quad) == 4 * sizeof(double));
  if (points.empty()) return;
  const double low = std::clamp(squares.least, 0.0, 1.0), high = std::clamp(squares.largest, 0.0, 1.0);
  const double half_span = 0.5 * falloff_rate * (high - low);
  std::size_t expansion = 0;
  while (expansion + 1 < expansions.size() && half_span > expansions[expansion].half_span) ++expansion;
  const double middle = 0.5 * (low + high);
  Job job{.points = points.front().data(),
          .count = points.size(),
          .contacts = contacts,
          .squared_range = squared_range,
          .middle = middle * squared_range,
          .coefficients = tables.coefficients[expansion],
          .sums = reinterpret_cast<double*>(sums.data())};
  double factor = std::exp(-falloff_rate * middle) / (1 - falloff_beta);
  for (int n = 0; n <= expansions[expansion].degree; ++n) {
    job.coefficients[static_cast<std::size_t>(n)] *= factor;
    factor *= -falloff_rate / squared_range;
  }
  job.coefficients[0] -= falloff_beta / (1 - falloff_beta);
  const std::size_t reach = squares.largest < wholly_within ? 1 : 0;
  tables.loops[falloff == Falloff::literal ? 0 : 1][reach][expansion](job);
}

}  // namespace handloft::geometry
