// A6: correct digits and time on NIST's reference data sets, of our QR in centred and scaled variables, of
// raw normal equations and of Eigen's ColPivHouseholderQR on the raw matrix, in the same run. Counters:
//   digits      of the worst coefficient in the variables that the method solves in,
//   raw_digits  of the worst coefficient of 1, x, x^2, ... (expanded in long double, so that only the solver
//               is judged), against the certified values,
//   rss_digits  of the residual sum of squares.
// The reference in centred and scaled variables is Householder QR in long double; that its own raw_digits are
// limited by the rounding of (x - c) / s to double is seen in the table (reference_long_double).

#include <benchmark/benchmark.h>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "server-model/geometry/row_qr.h"
#include "tests/unit/server-model/geometry/nist_data.h"
#include "tests/unit/server-model/geometry/test_surfaces.h"

namespace handloft::geometry {
namespace {

using LongMatrix = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
using LongVector = Eigen::Matrix<long double, Eigen::Dynamic, 1>;

/// A problem in the columns given: those of a polynomial in one variable, or (Longley) any.
struct Problem {
  Eigen::MatrixXd a;  ///< Raw columns.
  Eigen::VectorXd b;
  std::vector<double> certified;
  double certified_rss = 0;  ///< 0: an exact fit, which has no digits to count.
  bool polynomial = true;
};

Problem polynomial(std::span<const double> x, std::span<const double> y, std::span<const double> certified) {
  Problem problem;
  const auto p = static_cast<Eigen::Index>(certified.size());
  problem.a.resize(static_cast<Eigen::Index>(x.size()), p);
  problem.b = Eigen::Map<const Eigen::VectorXd>(y.data(), static_cast<Eigen::Index>(y.size()));
  for (Eigen::Index i = 0; i < problem.a.rows(); ++i) {
    double power = 1;
    for (Eigen::Index k = 0; k < p; ++k, power *= x[static_cast<std::size_t>(i)]) problem.a(i, k) = power;
  }
  problem.certified.assign(certified.begin(), certified.end());
  return problem;
}

Problem problem_of(int index) {
  switch (index) {
    case 0: {
      Problem filip = polynomial(nist::filip_x, nist::filip_y, nist::filip_coefficients);
      filip.certified_rss = nist::filip_residual_sum_of_squares;
      return filip;
    }
    case 1: {
      Problem longley;
      longley.a.resize(16, 7);
      longley.b.resize(16);
      for (Eigen::Index i = 0; i < 16; ++i) {
        const auto& row = nist::longley[static_cast<std::size_t>(i)];
        longley.a(i, 0) = 1;
        for (Eigen::Index k = 1; k < 7; ++k) longley.a(i, k) = row[static_cast<std::size_t>(k)];
        longley.b[i] = row[0];
      }
      longley.certified.assign(nist::longley_coefficients.begin(), nist::longley_coefficients.end());
      longley.certified_rss = nist::longley_residual_sum_of_squares;
      longley.polynomial = false;
      return longley;
    }
    default:
      break;
  }
  std::vector<double> x;
  for (int i = 0; i <= 20; ++i) x.push_back(i);
  std::vector<double> y;
  if (index == 3) {  // Wampler2: coefficients 1, 0.1, ..., 1e-5.
    for (const double t : x) {
      const double s = 0.1 * t;
      y.push_back(1 + s * (1 + s * (1 + s * (1 + s * (1 + s)))));
    }
    return polynomial(x, y, std::vector<double>{1, 0.1, 0.01, 0.001, 0.0001, 0.00001});
  }
  for (const double t : x) y.push_back(1 + t * (1 + t * (1 + t * (1 + t * (1 + t)))));
  if (index == 4) {
    y.assign(nist::wampler5_y.begin(), nist::wampler5_y.end());
    Problem wampler5 = polynomial(x, y, std::vector<double>(6, 1.0));
    wampler5.certified_rss = nist::wampler5_residual_sum_of_squares;
    return wampler5;
  }
  return polynomial(x, y, std::vector<double>(6, 1.0));
}

const char* name_of(int index) {
  static constexpr std::array names{"Filip", "Longley", "Wampler1", "Wampler2", "Wampler5"};
  return names[static_cast<std::size_t>(index)];
}

/// Column 1 centred and scaled to -1..1, and its powers; or (no polynomial) every column but the constant.
struct Scaled {
  Eigen::MatrixXd a;
  std::vector<double> centre, scale;  ///< Of each raw column.
};

Scaled scaled(const Problem& problem) {
  Scaled result;
  const Eigen::Index p = problem.a.cols();
  result.a = problem.a;
  result.centre.assign(static_cast<std::size_t>(p), 0.0);
  result.scale.assign(static_cast<std::size_t>(p), 1.0);
  for (Eigen::Index k = 1; k < p; ++k) {
    const Eigen::Index source = problem.polynomial ? 1 : k;
    const double low = problem.a.col(source).minCoeff();
    const double high = problem.a.col(source).maxCoeff();
    result.centre[static_cast<std::size_t>(k)] = (low + high) / 2;
    result.scale[static_cast<std::size_t>(k)] = (high - low) / 2;
    const Eigen::ArrayXd u = (problem.a.col(source).array() - (low + high) / 2) / ((high - low) / 2);
    if (problem.polynomial) {
      result.a.col(k) = result.a.col(k - 1).array() * u;
    } else {
      result.a.col(k) = u;
    }
  }
  return result;
}

std::vector<long double> raw_coefficients(const Problem& problem, const Scaled& scaled_problem,
                                          const LongVector& c) {
  const auto p = static_cast<std::size_t>(c.size());
  std::vector<long double> raw(p, 0);
  if (!problem.polynomial) {
    for (std::size_t k = 0; k < p; ++k) {
      const auto coefficient = c[static_cast<Eigen::Index>(k)];
      raw[k] = coefficient / scaled_problem.scale[k];
      if (k > 0) raw[0] -= raw[k] * scaled_problem.centre[k];
    }
    return raw;
  }
  const long double centre = scaled_problem.centre[1];
  const long double scale = scaled_problem.scale[1];
  for (std::size_t k = p; k-- > 0;) {  // Horner's rule over polynomials.
    std::vector<long double> next(p, 0);
    for (std::size_t i = 0; i < p; ++i) {
      next[i] -= raw[i] * centre / scale;
      if (i + 1 < p) next[i + 1] += raw[i] / scale;
    }
    next[0] += c[static_cast<Eigen::Index>(k)];
    raw = next;
  }
  return raw;
}

double worst_digits(std::span<const long double> found, std::span<const double> expected) {
  double worst = 16;
  for (std::size_t k = 0; k < expected.size(); ++k) {
    worst = std::min(worst, test::digits(static_cast<double>(found[k]), expected[k]));
  }
  return std::max(worst, 0.0);
}

/// Counters of a solution c of a c = b; `a` are the raw columns where `scaled_problem` is null.
void count_digits(benchmark::State& state, const Problem& problem, const Scaled* scaled_problem,
                  const LongVector& c) {
  const Eigen::MatrixXd& a = scaled_problem == nullptr ? problem.a : scaled_problem->a;
  std::vector<long double> raw;
  if (scaled_problem == nullptr) {
    raw.assign(c.data(), c.data() + c.size());
    state.counters["digits"] = worst_digits(raw, problem.certified);
  } else {
    raw = raw_coefficients(problem, *scaled_problem, c);
    const LongVector reference =
        Eigen::HouseholderQR<LongMatrix>(a.cast<long double>()).solve(problem.b.cast<long double>());
    double worst = 16;
    for (Eigen::Index k = 0; k < c.size(); ++k) {
      worst = std::min(worst, test::digits(static_cast<double>(c[k]), static_cast<double>(reference[k])));
    }
    state.counters["digits"] = worst;
  }
  state.counters["raw_digits"] = worst_digits(raw, problem.certified);
  if (problem.certified_rss > 0) {
    const LongVector r = a.cast<long double>() * c - problem.b.cast<long double>();
    state.counters["rss_digits"] =
        std::max(0.0, test::digits(static_cast<double>(r.squaredNorm()), problem.certified_rss));
  }
}

enum class Refinement { none, one_step };

template <Refinement refinement>
void ours_centred_scaled_qr(benchmark::State& state) {
  const Problem problem = problem_of(static_cast<int>(state.range(0)));
  state.SetLabel(name_of(static_cast<int>(state.range(0))));
  Eigen::VectorXd c;
  Scaled in_box;
  for (auto _ : state) {
    in_box = scaled(problem);
    const auto p = static_cast<int>(in_box.a.cols());
    Eigen::MatrixXd rows(in_box.a.rows(), p + 1);
    rows << in_box.a, problem.b;
    Eigen::MatrixXd workspace = rows;
    RowQr qr(p);
    qr.append(workspace);
    benchmark::DoNotOptimize(qr.rank(p, 1e-10));
    c = qr.solve(p);
    if constexpr (refinement == Refinement::one_step) qr.refine(rows, c);
    benchmark::DoNotOptimize(c.data());
  }
  count_digits(state, problem, &in_box, c.cast<long double>());
}

void baseline_raw_colpiv_qr(benchmark::State& state) {
  const Problem problem = problem_of(static_cast<int>(state.range(0)));
  state.SetLabel(name_of(static_cast<int>(state.range(0))));
  Eigen::VectorXd c;
  for (auto _ : state) {
    // The threshold is lowered, or Eigen takes Filip for rank 10 and has no digit right.
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(problem.a.rows(), problem.a.cols());
    qr.setThreshold(1e-30);
    c = qr.compute(problem.a).solve(problem.b);
    benchmark::DoNotOptimize(c.data());
  }
  count_digits(state, problem, nullptr, c.cast<long double>());
}

void baseline_raw_normal_equations(benchmark::State& state) {
  const Problem problem = problem_of(static_cast<int>(state.range(0)));
  state.SetLabel(name_of(static_cast<int>(state.range(0))));
  Eigen::VectorXd c;
  for (auto _ : state) {
    const Eigen::MatrixXd normal = problem.a.transpose() * problem.a;
    c = normal.ldlt().solve(problem.a.transpose() * problem.b);
    benchmark::DoNotOptimize(c.data());
  }
  count_digits(state, problem, nullptr, c.cast<long double>());
}

void baseline_centred_scaled_normal_equations(benchmark::State& state) {
  const Problem problem = problem_of(static_cast<int>(state.range(0)));
  state.SetLabel(name_of(static_cast<int>(state.range(0))));
  Eigen::VectorXd c;
  Scaled in_box;
  for (auto _ : state) {
    in_box = scaled(problem);
    const Eigen::MatrixXd normal = in_box.a.transpose() * in_box.a;
    c = normal.ldlt().solve(in_box.a.transpose() * problem.b);
    benchmark::DoNotOptimize(c.data());
  }
  count_digits(state, problem, &in_box, c.cast<long double>());
}

void reference_long_double(benchmark::State& state) {
  const Problem problem = problem_of(static_cast<int>(state.range(0)));
  state.SetLabel(name_of(static_cast<int>(state.range(0))));
  const Scaled in_box = scaled(problem);
  LongVector c;
  for (auto _ : state) {
    c = Eigen::HouseholderQR<LongMatrix>(in_box.a.cast<long double>()).solve(problem.b.cast<long double>());
    benchmark::DoNotOptimize(c.data());
  }
  count_digits(state, problem, &in_box, c);
}

void all_problems(benchmark::internal::Benchmark* benchmark) {
  benchmark->DenseRange(0, 4)->Unit(benchmark::kMicrosecond);
}
BENCHMARK_TEMPLATE(ours_centred_scaled_qr, Refinement::none)->Apply(all_problems);
BENCHMARK_TEMPLATE(ours_centred_scaled_qr, Refinement::one_step)->Apply(all_problems);
BENCHMARK(baseline_raw_colpiv_qr)->Apply(all_problems);
BENCHMARK(baseline_raw_normal_equations)->Apply(all_problems);
BENCHMARK(baseline_centred_scaled_normal_equations)->Apply(all_problems);
BENCHMARK(reference_long_double)->Apply(all_problems);

}  // namespace
}  // namespace handloft::geometry
