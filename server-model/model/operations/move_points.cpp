// Moving points of a region, and their linked mirror images as their images (A12).

#include <fmt/format.h>

#include <vector>

#include "server-model/geometry/symmetry.h"
#include "server-model/model/operations/operations.h"
#include "server-model/model/operations/point_region.h"
#include "server-model/model/validate.h"

namespace handloft::model {
namespace {

DualPoint at(DualPoint point, const geometry::Vec3& place) {
  point.x = place.x();
  point.y = place.y();
  point.z = place.z();
  return point;
}

/// Points of a shape in one array, to be changed and put back.
struct Loose {
  explicit Loose(const DualShape& shape) : points(shape.points.begin(), shape.points.end()) {}
  void into(DualShape& shape) const {
    shape.points = PointCloud();
    shape.points.append(points);
    shape.stale = shape.fitted();
  }
  std::vector<DualPoint> points;
};

}  // namespace

Result<Outcome> move_points(const Document& document, const handloft::v1::MovePoints& request,
                            const ApplyContext& context) {
  auto found = require_dual(document, request.entity(), "move_points.entity");
  if (!found) return found.error();
  auto by = read_vector(request.by(), "move_points.by", context.limits);
  if (!by) return by.error();
  DualShape shape = **found;
  auto selected = points_in(request.region(), shape, "move_points.region", context.limits);
  if (!selected) return selected.error();

  Outcome outcome;
  outcome.document = document;
  *outcome.effective.mutable_move_points() = request;
  outcome.words = fmt::format("Move {} point{} of \"{}\"", selected->size(), selected->size() == 1 ? "" : "s",
                              shape.name);
  if (selected->empty()) {
    outcome.notes.push_back(fmt::format("\"{}\": no point lies in the region", shape.id));
    return outcome;
  }
  if (by->isZero(0)) return outcome;

  const DualPtr linked = linked_partner(document, shape);
  Loose loose(shape);
  std::optional<Loose> partner_loose;
  if (linked) partner_loose.emplace(*linked);
  std::vector<bool> is_image(shape.points.size(), false);
  bool partner_moved = false;
  const auto outside = [&](const geometry::Vec3& p) {
    return !(p.cwiseAbs().maxCoeff() <= context.limits.max_coordinate_m);
  };
  for (const std::uint32_t i : *selected) {
    if (is_image[i]) continue;  // It has moved with the point that it mirrors.
    const geometry::Vec3 place = loose.points[i].position() + *by;
    loose.points[i] = at(loose.points[i], place);
    const std::uint32_t image = shape.mirror_partner(i);
    geometry::Vec3 image_place = place;
    if (image != DualPoint::no_partner) {
      image_place = geometry::reflect_point(place, shape.plane);
      if (shape.symmetry == SymmetryMode::same_shape) {
        loose.points[image] = at(loose.points[image], image_place);
        is_image[image] = true;
      } else if (partner_loose) {
        partner_loose->points[image] = at(partner_loose->points[image], image_place);
        partner_moved = true;
      }
    }
    if (outside(place) || outside(image_place)) {
      return make_error(
          ErrorCode::invalid_argument,
          fmt::format("would move point {} out of the workspace of {} m", i, context.limits.max_coordinate_m),
          "move_points.by");
    }
  }
  loose.into(shape);
  put(outcome.document, std::move(shape));
  if (partner_moved) {
    DualShape partner = *linked;
    partner_loose->into(partner);
    put(outcome.document, std::move(partner));
  }
  return outcome;
}

}  // namespace handloft::model
