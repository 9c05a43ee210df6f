// Deleting points of a region, and their linked mirror images with them (A12).

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "server-model/model/operations/operations.h"
#include "server-model/model/operations/point_region.h"
#include "server-model/model/validate.h"

namespace handloft::model {
namespace {

constexpr std::uint32_t gone = DualPoint::no_partner;

/// New index of each point, `gone` for those that go. `leaving` is ascending.
std::vector<std::uint32_t> renumber(std::size_t count, const std::vector<std::uint32_t>& leaving) {
  std::vector<std::uint32_t> index(count, 0);
  for (const std::uint32_t i : leaving) index[i] = gone;
  std::uint32_t next = 0;
  for (std::uint32_t& i : index) {
    if (i != gone) i = next++;
  }
  return index;
}

/// The shape without the points that are gone. `images` renumbers what mirror_partner() points into: the same
/// shape or the partner.
DualShape without(const DualShape& before, const std::vector<std::uint32_t>& index,
                  const std::vector<std::uint32_t>& images) {
  DualShape shape = before;
  std::vector<DualPoint> kept;
  kept.reserve(before.points.size());
  std::uint32_t unlinked = 0;
  for (std::size_t i = 0; i < before.points.size(); ++i) {
    if (index[i] == gone) continue;
    DualPoint point = before.points[i];
    // A link that no longer holds would point at another one's image after this.
    const std::uint32_t image = before.mirror_partner(i);
    point.partner = image == DualPoint::no_partner ? image : images[image];
    if (i < before.linked_from) ++unlinked;
    kept.push_back(point);
  }
  const std::size_t kept_count = kept.size();
  shape.points = PointCloud();
  shape.points.append(kept);
  shape.linked_from = unlinked;
  if (before.fit && kept_count != before.points.size()) {
    shape.stale = true;
    // Residuals go by index; those of the points that remain stay theirs (A8).
    auto fit = std::make_shared<FittedSurface>(*before.fit);
    fit->residuals_m.clear();
    for (std::size_t i = 0; i < std::min(before.fit->residuals_m.size(), index.size()); ++i) {
      if (index[i] != gone) fit->residuals_m.push_back(before.fit->residuals_m[i]);
    }
    shape.fit = std::move(fit);
  }
  return shape;
}

}  // namespace

Result<Outcome> delete_points(const Document& document, const handloft::v1::DeletePoints& request,
                              const ApplyContext& context) {
  auto found = require_dual(document, request.entity(), "delete_points.entity");
  if (!found) return found.error();
  const DualShape& shape = **found;
  auto selected = points_in(request.region(), shape, "delete_points.region", context.limits);
  if (!selected) return selected.error();

  Outcome outcome;
  outcome.document = document;
  *outcome.effective.mutable_delete_points() = request;
  std::vector<std::uint32_t> leaving = std::move(*selected);
  outcome.words =
      fmt::format("Delete {} point{} of \"{}\"", leaving.size(), leaving.size() == 1 ? "" : "s", shape.name);
  if (leaving.empty()) {
    outcome.notes.push_back(fmt::format("\"{}\": no point lies in the region", shape.id));
    return outcome;
  }
  std::vector<std::uint32_t> images;
  for (const std::uint32_t i : leaving) {
    const std::uint32_t image = shape.mirror_partner(i);
    if (image != DualPoint::no_partner) images.push_back(image);
  }
  std::sort(images.begin(), images.end());
  if (shape.symmetry == SymmetryMode::same_shape) {
    leaving.insert(leaving.end(), images.begin(), images.end());
    std::sort(leaving.begin(), leaving.end());
    leaving.erase(std::unique(leaving.begin(), leaving.end()), leaving.end());
    const auto index = renumber(shape.points.size(), leaving);
    put(outcome.document, without(shape, index, index));
    return outcome;
  }
  const auto index = renumber(shape.points.size(), leaving);
  const DualPtr partner = linked_partner(document, shape);
  if (!partner) {
    put(outcome.document, without(shape, index, index));
    return outcome;
  }
  const auto partner_index = renumber(partner->points.size(), images);
  put(outcome.document, without(shape, index, partner_index));
  // Also where none of its own go: the numbers of their originals have changed.
  put(outcome.document, without(*partner, partner_index, index));
  return outcome;
}

}  // namespace handloft::model
