#pragma once
// The fit of points that come and go while a hand draws: keeps R and Q^T z (RowQr) so that adding, removing
// and solving cost O(p^2) for p coefficients, whatever the number of points (A27).
//
// The variables are scaled to a box that grows with the footprint. Growth does not touch the points: the new
// monomials are S times the old ones, S lower triangular in the order of eq. 2, so R S^T is the new triangle
// and Q^T z stays. Since the new box holds the old one, no row of S has a sum of absolute values above 1: a
// step of growth adds no more error than rounding the matrix.
//
// R is built anew from the points, at the next solve(), when it would have lost half of its digits:
//   - taking one point out leaves a direction less than 1e-4 of its length (RowQr::remove_row), or
//   - a diagonal element of R has fallen below 1e-4 of the largest that it had since R was last built, or
//   - as many points have been taken out since then as remain. Over n removals this costs O(n p^2), so
//     O(p^2) for each, and it lets the box shrink after the points.

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/polynomial_fit.h"
#include "server-model/geometry/row_qr.h"
#include "server-model/geometry/types.h"

namespace handloft::geometry {

/// Not for use from two threads at once.
class PolynomialFitter {
 public:
  /// Names one point until it is removed; a point added later may then take its place. So memory is that of
  /// the largest number of points held at once.
  using Slot = std::size_t;

  /// Precondition: options.degree in 1..6 (else every function answers invalid_argument).
  explicit PolynomialFitter(const FitOptions& options = {});

  /// Takes a point of the local frame, O(p^2) (O(p^3) when the box grows), never O(n). Errors:
  /// invalid_argument as fit_polynomial_surface(), and nothing changes.
  Result<Slot> add(const WeightedPoint& local_point);
  /// Takes many, with one factorisation. All or nothing. Slots are consecutive from the returned one.
  Result<Slot> add(std::span<const WeightedPoint> local_points);
  /// Takes a point out again, O(p^2). Errors: not_found for a slot that holds no point.
  Status remove(Slot slot);

  std::size_t size() const { return live_count_; }
  /// The current optimum, without statistics over points (statistics.weighted_rms and count alone are filled,
  /// the former from the residual norm that QR carries along). Builds R anew first where the above asks for
  /// it. Errors: rank_deficient.
  Result<PolynomialFit> solve();

  /// How often R was built from all points: by adding many at once, and by the three criteria above.
  std::size_t refactorisations() const { return refactorisations_; }
  /// How often the box grew.
  std::size_t growths() const { return growths_; }
  /// Places for points that are held, free or not.
  std::size_t capacity() const { return chunk_count_ * chunk_points; }

 private:
  struct Sample {
    WeightedPoint point;
    Slot next_free = 0;  ///< In the list of free slots.
    bool live = false;
  };
  /// Points are kept in chunks, and these in shelves, so that no addition has to move those before it or to
  /// ask the system for more than a page (3 and 4 KB) at once.
  static constexpr std::size_t chunk_points = 64;
  static constexpr std::size_t shelf_chunks = 512;
  using Chunk = std::array<Sample, chunk_points>;
  using Shelf = std::array<std::unique_ptr<Chunk>, shelf_chunks>;

  std::unique_ptr<Chunk>& chunk(std::size_t k) { return (*shelves_[k / shelf_chunks])[k % shelf_chunks]; }
  Sample& sample(Slot slot) { return (*chunk(slot / chunk_points))[slot % chunk_points]; }
  /// One more than the last slot: the end of the list of free ones.
  static constexpr Slot no_slot = static_cast<Slot>(-1);

  Slot hold(const WeightedPoint& point, Slot slot);
  Slot next_slot();
  /// Makes the box hold the rectangle, if it lies farther out than max_scaled_coordinate.
  void make_room_for(const Vec2& lower, const Vec2& upper);
  void refactor();
  void collect_free_slots();
  void note_diagonal();
  void forget();

  FitOptions options_;
  Box2 box_;
  RowQr qr_;
  std::vector<std::unique_ptr<Shelf>> shelves_;
  std::size_t chunk_count_ = 0;
  std::size_t slot_count_ = 0;  ///< Slots below this have been used.
  Slot first_free_ = no_slot;   ///< Those of them that hold no point, as a list.
  std::size_t live_count_ = 0;
  std::size_t weighted_count_ = 0;
  std::size_t removed_since_built_ = 0;
  double weight_sum_ = 0;
  std::array<double, max_coefficients> largest_diagonal_{};
  bool dirty_ = false;  ///< R does not stand for the points; solve() builds it.
  std::size_t refactorisations_ = 0;
  std::size_t growths_ = 0;
};

}  // namespace handloft::geometry
