#pragma once
// Knot vectors of B-splines, open and periodic, and the basis functions over them: evaluation with
// derivatives by the triangular scheme of Cox and de Boor (Piegl and Tiller, The NURBS Book, A2.1 - A2.3).

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "common/base/result.h"

namespace handloft::geometry {

/// n control values, degree p, parameters in [lower(), upper()]. Function i belongs to control value
/// i % control_count().
/// - open: n + p + 1 knots; function_count() == n. Clamped (end knots p + 1 times) or not.
/// - periodic: knots t_p .. t_(p+n) bound one period, n spans at most, n >= 2; p more on each side repeat the
///   pattern, so that all n + 2p + 1 are held; function_count() == n + p, of which the last p are the first p
///   again.
class KnotVector {
 public:
  static constexpr int max_degree = 24;              ///< As STEP readers take (OCCT's limit is 25).
  static constexpr int max_control_count = 1 << 22;  ///< No more memory than this is asked for.

  /// The knots as the kind says. Errors: invalid_argument for a degree outside 1..max_degree, a count that
  /// fits no kind, numbers that are not finite or descend, a domain without length, an inner knot more than p
  /// times (p + 1 times would tear it), a periodic pattern that does not repeat (to 1e-12 of the period).
  /// Knots that differ by rounding (1e-14 of the domain) become equal.
  static Result<KnotVector> open(int degree, std::vector<double> knots);
  static Result<KnotVector> periodic(int degree, std::vector<double> knots);
  /// Equal spans over [0, 1]: clamped with n >= p + 1, periodic with n >= p + 1. Errors: invalid_argument.
  static Result<KnotVector> uniform(int degree, int control_count);
  static Result<KnotVector> uniform_periodic(int degree, int control_count);

  int degree() const { return degree_; }
  bool is_periodic() const { return periodic_; }
  int control_count() const { return control_count_; }
  int function_count() const { return static_cast<int>(knots_.size()) - degree_ - 1; }
  int control_of(int function) const { return periodic_ ? function % control_count_ : function; }
  const std::vector<double>& knots() const { return knots_; }
  double lower() const { return knots_[static_cast<std::size_t>(degree_)]; }
  double upper() const { return knots_[knots_.size() - 1 - static_cast<std::size_t>(degree_)]; }
  double length() const { return upper() - lower(); }

  /// Into the domain: clamped, or by whole periods. NaN becomes lower().
  double wrap(double u) const;
  /// The index s with knots[s] <= u < knots[s + 1], p <= s; at upper() of an open one the last span that has
  /// a length. `u` is wrapped first. O(log n).
  int span(double u) const;
  /// All s whose span in the domain has a length, ascending.
  std::vector<int> spans() const;
  /// How often u is a knot, exactly.
  int multiplicity(double u) const;
  /// The mean of function i's p inner knots: where a control value acts most.
  double greville(int function) const;

  bool operator==(const KnotVector&) const = default;

 private:
  KnotVector(int degree, bool periodic, int control_count, std::vector<double> knots)
      : degree_(degree), periodic_(periodic), control_count_(control_count), knots_(std::move(knots)) {}

  int degree_;
  bool periodic_;
  int control_count_;
  std::vector<double> knots_;
};

/// The p + 1 functions that do not vanish in span s, s - p .. s, and their derivatives up to `order`, at u:
/// values[k * (p + 1) + i] is the k-th derivative of function s - p + i. `values` has (order + 1)(p + 1)
/// places; derivatives above the degree are 0. `u` must lie in the span (its right end allowed). Allocates
/// nothing.
void basis_functions(const KnotVector& knots, int span, double u, int order, std::span<double> values);

/// Functions and their derivatives at many parameters, for sums over grids.
struct BasisTable {
  int degree = 1;
  int order = 0;
  std::vector<int> first_function;  ///< One a parameter: span - p.
  std::vector<double> values;       ///< (order + 1)(p + 1) a parameter, as basis_functions() writes them.

  std::size_t size() const { return first_function.size(); }
  std::span<const double> at(std::size_t parameter, int derivative) const {
    const auto width = static_cast<std::size_t>(degree) + 1;
    return {values.data() +
                (parameter * (static_cast<std::size_t>(order) + 1) + static_cast<std::size_t>(derivative)) *
                    width,
            width};
  }
};
BasisTable tabulate(const KnotVector& knots, std::span<const double> parameters, int order);

}  // namespace handloft::geometry
