#pragma once
// Loops and sums over very long vectors, in parallel by chunks. The order of additions depends on the length
// alone, so that no result depends on the number of threads.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "server-model/geometry/bordered_cholesky.h"
#include "server-model/geometry/propagation.h"

namespace handloft::geometry {

class ChunkedSums {
 public:
  static constexpr std::size_t chunk = 16384;  ///< Numbers a task; sums are added chunk by chunk.

  ChunkedSums(std::size_t length, ParallelFor parallel) : length_(length), parallel_(std::move(parallel)) {}

  /// task(index of the chunk, first, last).
  template <typename Task>
  void in_chunks(const Task& task) const {
    parallel_((length_ + chunk - 1) / chunk,
              [&](std::size_t index) { task(index, index * chunk, std::min(length_, (index + 1) * chunk)); });
  }

  /// The sum of term(i), eight sums side by side in each chunk.
  template <typename Term>
  double sum(const Term& term) const {
    std::vector<double> parts((length_ + chunk - 1) / chunk);
    in_chunks([&](std::size_t index, std::size_t first, std::size_t last) {
      Lanes sums;
      std::size_t i = first;
      for (; i + panel_lanes <= last; i += panel_lanes)
        for (std::size_t l = 0; l < panel_lanes; ++l) sums.v[l] += term(i + l);
      for (; i < last; ++i) sums.v[0] += term(i);
      for (const double part : sums.v) parts[index] += part;
    });
    double total = 0;
    for (const double part : parts) total += part;
    return total;
  }

  double norm(std::span<const double> a) const {
    return std::sqrt(sum([&](std::size_t i) { return a[i] * a[i]; }));
  }
  double dot(std::span<const double> a, std::span<const double> b) const {
    return sum([&](std::size_t i) { return a[i] * b[i]; });
  }

 private:
  std::size_t length_;
  ParallelFor parallel_;
};

}  // namespace handloft::geometry
