#pragma once
// Cholesky's factor of a symmetric positive definite band matrix with a border: the last rows are full, as
// those are that close a ring. Elements are numbers, or several numbers side by side, each of a matrix of its
// own.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "server-model/geometry/stiffness_loops.h"

namespace handloft::geometry {

struct alignas(panel_lanes * sizeof(double)) Lanes {
  std::array<double, panel_lanes> v{};
};

inline void subtract_product(double& a, double b, double c) {
  a -= b * c;
}
inline void multiply_by(double& a, double b) {
  a *= b;
}
/// Becomes 1 / sqrt(a); false unless a is positive and finite.
inline bool invert_root(double& a) {
  const bool fine = a > 0 && std::isfinite(a);
  if (fine) a = 1 / std::sqrt(a);
  return fine;
}
inline void subtract_product(Lanes& a, const Lanes& b, const Lanes& c) {
  for (std::size_t l = 0; l < panel_lanes; ++l) a.v[l] -= b.v[l] * c.v[l];
}
inline void multiply_by(Lanes& a, const Lanes& b) {
  for (std::size_t l = 0; l < panel_lanes; ++l) a.v[l] *= b.v[l];
}
inline bool invert_root(Lanes& a) {
  bool fine = true;
  for (double& value : a.v) fine = invert_root(value) && fine;
  return fine;
}

template <typename Element>
class BorderedCholesky {
 public:
  BorderedCholesky() = default;
  /// Rows 0 .. size - border - 1 reach back `reach` columns, the others to the first.
  BorderedCholesky(std::size_t size, std::size_t reach, std::size_t border)
      : size_(size),
        reach_(reach),
        inner_(size - std::min(border, size)),
        elements_(inner_ * (reach + 1) + (size - inner_) * size) {}

  std::size_t size() const { return size_; }
  /// The first column of a row.
  std::size_t start(std::size_t row) const { return row >= inner_ || row < reach_ ? 0 : row - reach_; }
  /// start(row) <= column <= row. To be filled with the matrix before factor().
  Element& at(std::size_t row, std::size_t column) { return elements_[place(row) + column]; }

  /// False when the matrix is not positive definite, or has numbers that are not finite.
  bool factor() {
    for (std::size_t i = 0; i < size_; ++i) {
      Element* const row = elements_.data() + place(i);
      for (std::size_t j = start(i); j < i; ++j) {
        const Element* const other = elements_.data() + place(j);
        for (std::size_t k = std::max(start(i), start(j)); k < j; ++k)
          subtract_product(row[j], row[k], other[k]);
        multiply_by(row[j], other[j]);
      }
      for (std::size_t k = start(i); k < i; ++k) subtract_product(row[i], row[k], row[k]);
      if (!invert_root(row[i])) return false;
    }
    return true;
  }

  /// In place, with the factor.
  void solve(Element* x) const {
    for (std::size_t i = 0; i < size_; ++i) {
      const Element* const row = elements_.data() + place(i);
      for (std::size_t k = start(i); k < i; ++k) subtract_product(x[i], row[k], x[k]);
      multiply_by(x[i], row[i]);
    }
    for (std::size_t i = size_; i-- > 0;) {
      const Element* const row = elements_.data() + place(i);
      multiply_by(x[i], row[i]);
      for (std::size_t k = start(i); k < i; ++k) subtract_product(x[k], row[k], x[i]);
    }
  }

 private:
  // Where column 0 of a row would stand.
  std::size_t place(std::size_t row) const {
    return row < inner_ ? row * (reach_ + 1) + reach_ - row : inner_ * (reach_ + 1) + (row - inner_) * size_;
  }

  std::size_t size_ = 0, reach_ = 0, inner_ = 0;
  std::vector<Element> elements_;
};

}  // namespace handloft::geometry
