#pragma once
// The surface of a fitted shape while a gesture adds points to it (AddPoints.refit): it follows each point in
// O(p^2) by PolynomialFitter, where the committed operation fits all points at once. Both are backward stable
// QR of the same rows in the same frozen frame, so the preview differs from what is committed by rounding
// alone: at most 1e-12 of the footprint's size in the tests, for every degree that the points carry with a
// pivot above 1e-8. Nearer to the threshold of 1e-10 (A7) the preview, whose scaling box is up to twice as
// large, may show a lower degree than the committed surface. What needs all points is left out of the
// preview: residuals and their unweighted statistics, and the drift of the base plane (that of the last fit
// stays).

#include <string>
#include <vector>

#include "server-model/geometry/polynomial_fitter.h"
#include "server-model/model/document.h"

namespace handloft::model {

class LiveFit {
 public:
  /// Of the entity and its linked partner, as far as they are fitted. O(points).
  LiveFit(const Document& document, const std::string& entity);

  /// Fits the points that `document` has gained since the last time, and puts the surfaces in. O(p^2) for
  /// each new point. A shape whose points carry no surface keeps the one that it had, stale.
  void follow(Document& document);

 private:
  struct Followed {
    std::string entity;
    geometry::Frame frame;
    geometry::PolynomialFitter fitter;
    std::size_t taken = 0;  ///< Points of the shape that the fitter has.
  };
  void take_new_points(const DualShape& shape, Followed& followed) const;

  std::vector<Followed> followed_;
};

}  // namespace handloft::model
