#include "server-model/interaction/icon_finder.h"

#include <algorithm>
#include <limits>

#include "server-model/model/sculpt_place.h"
#include "server-model/model/sculpt_solve.h"

namespace handloft::interaction {

using Eigen::Vector3d;

const model::SculptIcon* find_icon(const model::Document& document, const IconName& name) {
  const model::SculptPtr shape = model::as_sculpt(document.find(name.entity));
  return shape ? shape->find_icon(name.icon) : nullptr;  // Lives as long as the document does.
}

bool is_driven_by(const model::SculptIcon& icon, std::string_view sensor) {
  if (icon.state != model::IconState::driving) return false;
  if (icon.sensors.empty()) return sensor == hand_sensor;
  return std::find(icon.sensors.begin(), icon.sensors.end(), sensor) != icon.sensors.end();
}

void IconFinder::forget_removed(const model::Document& document) {
  std::erase_if(known_, [&](const auto& entry) { return !document.entities.contains(entry.first); });
}

IconFinder::Known& IconFinder::known(const model::SculptPtr& shape) {
  Known& known = known_[shape->id];
  if (known.shape == shape) return known;
  known = Known();
  known.shape = shape;
  for (const Vector3d& point : shape->surface->control) known.box.extend(point);
  known.outlines.reserve(shape->icons->size());
  for (const model::SculptIcon& icon : *shape->icons) {
    known.outlines.push_back(model::icon_outline(icon, *shape->surface));
    known.box.extend(icon.place);  // A load is held where the hand has it, not on the surface.
  }
  return known;
}

NearIcon IconFinder::look(const Known& known, std::size_t index, const Vector3d& at) {
  const model::SculptIcon& icon = (*known.shape->icons)[index];
  NearIcon near{{known.shape->id, icon.id}, (icon.place - at).norm(), 0};
  const std::vector<Vector3d>& outline = known.outlines[index];
  double before_m = 0;
  double least_m = std::numeric_limits<double>::infinity();
  double along_m = 0;
  for (std::size_t i = 1; i < outline.size(); ++i) {
    const Vector3d step = outline[i] - outline[i - 1];
    const double length = step.norm();
    const double t =
        length > 0 ? std::clamp((at - outline[i - 1]).dot(step) / (length * length), 0.0, 1.0) : 0;
    const double distance = (outline[i - 1] + t * step - at).norm();
    if (distance < least_m) {
      least_m = distance;
      along_m = before_m + t * length;
    }
    before_m += length;
  }
  near.distance_m = std::min(near.distance_m, least_m);
  if (before_m > 0) near.along = std::clamp(along_m / before_m, 0.0, 1.0);
  return near;
}

std::optional<NearIcon> IconFinder::nearest(const model::Document& document, const Vector3d& at,
                                            const std::set<IconName>& but) {
  forget_removed(document);
  std::optional<NearIcon> best;
  for (const auto& [id, entity] : document.entities) {
    const model::SculptPtr shape = model::as_sculpt(entity);
    if (!shape || shape->icons->empty()) continue;
    const Known& seen = known(shape);
    if (seen.box.squaredExteriorDistance(at) > reach_m_ * reach_m_) continue;
    for (std::size_t i = 0; i < shape->icons->size(); ++i) {
      NearIcon near = look(seen, i, at);
      if (near.distance_m > reach_m_ || (best && near.distance_m >= best->distance_m)) continue;
      if (!but.contains(near.name)) best = std::move(near);
    }
  }
  return best;
}

std::optional<NearIcon> IconFinder::within_reach(const model::Document& document, const IconName& name,
                                                 const Vector3d& at) {
  const model::SculptPtr shape = model::as_sculpt(document.find(name.entity));
  if (!shape) return std::nullopt;
  for (std::size_t i = 0; i < shape->icons->size(); ++i) {
    if ((*shape->icons)[i].id != name.icon) continue;
    NearIcon near = look(known(shape), i, at);
    if (near.distance_m <= reach_m_) return near;
  }
  return std::nullopt;
}

std::optional<NearSculpted> IconFinder::nearest_surface(const model::Document& document, const Vector3d& at,
                                                        std::string_view entity) {
  forget_removed(document);
  std::optional<NearSculpted> best;
  for (const auto& [id, each] : document.entities) {
    const model::SculptPtr shape = model::as_sculpt(each);
    if (!shape || (!entity.empty() && id != entity)) continue;
    Known& seen = known(shape);
    const double limit_m = best ? best->distance_m : reach_m_;
    if (!seen.projectable || seen.box.squaredExteriorDistance(at) > limit_m * limit_m) continue;
    if (!seen.projector) {
      if (auto made = model::make_projector(*shape)) {
        seen.projector.emplace(std::move(*made));
      } else {
        seen.projectable = false;  // Its trim encloses nothing: there is nothing to be near to.
        continue;
      }
    }
    const auto closest = seen.projector->closest(at);
    if (!closest || closest->distance_m > limit_m) continue;
    if (best && closest->distance_m == best->distance_m) continue;
    best = NearSculpted{id, closest->distance_m};
  }
  return best;
}

}  // namespace handloft::interaction
