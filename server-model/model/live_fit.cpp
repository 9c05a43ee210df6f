#include "server-model/model/live_fit.h"

#include <memory>

#include "server-model/model/operations/fitting.h"
#include "server-model/model/operations/operations.h"

namespace handloft::model {

LiveFit::LiveFit(const Document& document, const std::string& entity) {
  const DualPtr shape = document.find_dual(entity);
  if (!shape) return;
  for (const DualPtr& one : {shape, linked_partner(document, *shape)}) {
    if (!one || !one->fitted()) continue;
    geometry::FitOptions options;
    options.degree = static_cast<int>(one->fit->requested_degree);
    followed_.push_back({one->id, one->fit->frame, geometry::PolynomialFitter(options), 0});
    take_new_points(*one, followed_.back());
  }
}

void LiveFit::take_new_points(const DualShape& shape, Followed& followed) const {
  std::vector<geometry::WeightedPoint> points;
  points.reserve(shape.points.size() - followed.taken);
  for (std::size_t i = followed.taken; i < shape.points.size(); ++i) {
    const DualPoint& point = shape.points[i];
    points.push_back({followed.frame.to_local(point.position()), point.pressure});
  }
  followed.taken = shape.points.size();
  // The model has checked the numbers: nothing is refused here.
  if (points.size() == 1) {
    (void)followed.fitter.add(points.front()).ok();
  } else {
    (void)followed.fitter.add(points).ok();
  }
}

void LiveFit::follow(Document& document) {
  for (Followed& followed : followed_) {
    const DualPtr before = document.find_dual(followed.entity);
    if (!before || !before->fitted() || before->points.size() <= followed.taken) continue;
    const std::size_t first = followed.taken;
    take_new_points(*before, followed);
    auto solved = followed.fitter.solve();
    if (!solved) continue;
    auto fit = std::make_shared<FittedSurface>();
    fit->frame = before->fit->frame;
    fit->surface = solved->surface;
    fit->requested_degree = before->fit->requested_degree;
    fit->statistics = solved->statistics;
    fit->box = before->fit->box;
    fit->frame_drift_rad = before->fit->frame_drift_rad;
    geometry::Vec2 lower = fit->box.lower();
    geometry::Vec2 upper = fit->box.upper();
    for (std::size_t i = first; i < before->points.size(); ++i) {
      const geometry::Vec2 place = fit->frame.to_local(before->points[i].position()).head<2>();
      lower = lower.cwiseMin(place);
      upper = upper.cwiseMax(place);
    }
    fit->box = {0.5 * (lower + upper), 0.5 * (upper - lower)};
    if (!finite(*fit)) continue;
    DualShape shape = *before;
    shape.fit = std::move(fit);
    shape.stale = false;
    put(document, std::move(shape));
  }
}

}  // namespace handloft::model
