#include "server-model/model/sculpt_pins.h"

#include <algorithm>
#include <utility>

#include "server-model/model/sculpt_demands.h"
#include "server-model/model/sculpt_icon.h"

namespace handloft::model {

using geometry::SculptField;
using geometry::SculptRow;
using geometry::Vec3;

namespace {

bool is_pinned(const SculptIcon& icon, const SculptRow& row) {
  return icon.shape != IconShape::point && !row.along && row.yield == 0;
}

/// The fields of one icon: weights by its rows, in their order, and amounts; zeros are left out.
std::vector<SculptField> fields_of(const SculptIcon& icon, const SculptShape& shape,
                                   const std::vector<Vec3>& rest, const std::vector<Vec3>& target) {
  const std::vector<Vec3>& reference = *icon.reference;
  std::vector<SculptField> fields;
  const auto add = [&](const auto& weight, const Vec3& amount) {
    if (amount.isZero(0)) return;
    SculptField field;
    bool any = false;
    for (std::size_t i = 0; i < rest.size(); ++i) {
      field.weight.push_back(weight(i) + 0.0);  // No -0.
      any = any || field.weight.back() != 0;
    }
    field.amount = amount;
    if (any) fields.push_back(std::move(field));
  };
  if (reference.size() != rest.size()) {  // Not one row a reference: as the rows have it.
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      add([&](std::size_t i) { return target[i][axis] - rest[i][axis]; }, Vec3::Unit(axis));
    return fields;
  }
  add([](std::size_t) { return 1.0; }, icon.translation);
  if (icon.rotation.vec() != Vec3::Zero()) {
    const Eigen::Matrix3d turn = icon.rotation.toRotationMatrix() - Eigen::Matrix3d::Identity();
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      add([&](std::size_t i) { return reference[i][axis] - icon.pivot[axis]; }, turn.col(axis));
  }
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    add([&](std::size_t i) { return reference[i][axis] - rest[i][axis]; }, Vec3::Unit(axis));
  for (const IconBend& bend : icon.bends) {
    const std::vector<double> weight = bend_weights(icon, bend, *shape.rest, reference);
    add([&](std::size_t i) { return weight[i]; }, bend.translation);
  }
  return fields;
}

}  // namespace

PinnedIcons take_pins(const SculptShape& shape, std::vector<SculptRow>& rows,
                      std::vector<std::size_t>& owner) {
  PinnedIcons result;
  std::vector<SculptRow> left, taken;
  std::vector<std::size_t> left_owner, taken_owner;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const bool pinned = is_pinned((*shape.icons)[owner[i]], rows[i]);
    (pinned ? taken_owner : left_owner).push_back(owner[i]);
    (pinned ? taken : left).push_back(std::move(rows[i]));
  }
  rows = std::move(left);
  owner = std::move(left_owner);

  // Single control points first, ascending, each once: of two icons the first has it, the other's is a row.
  const auto is_point = [](const SculptRow& row) {
    return row.functional.point.size() == 1 && row.functional.value.front() == 1;
  };
  std::vector<std::size_t> points, others;
  for (std::size_t i = 0; i < taken.size(); ++i) (is_point(taken[i]) ? points : others).push_back(i);
  std::stable_sort(points.begin(), points.end(), [&](std::size_t a, std::size_t b) {
    return taken[a].functional.point.front() < taken[b].functional.point.front();
  });
  std::vector<std::size_t> order;
  std::vector<std::size_t> twice;
  for (const std::size_t i : points) {
    const std::uint32_t point = taken[i].functional.point.front();
    if (!result.pins.points.empty() && result.pins.points.back() == point) {
      twice.push_back(i);
      continue;
    }
    result.pins.points.push_back(point);
    order.push_back(i);
  }
  others.insert(others.end(), twice.begin(), twice.end());
  order.insert(order.end(), others.begin(), others.end());
  std::vector<std::size_t> pin_of(taken.size());
  for (std::size_t pin = 0; pin < order.size(); ++pin) {
    const SculptRow& row = taken[order[pin]];
    pin_of[order[pin]] = pin;
    if (pin >= result.pins.points.size()) result.pins.rows.push_back(row.functional);
    result.owner.push_back(taken_owner[order[pin]]);
    result.target.push_back(row.target);
    result.tolerance_m.push_back(row.tolerance);
  }

  for (std::size_t first = 0; first < taken.size();) {
    std::size_t end = first;
    std::vector<Vec3> rest, target;
    for (; end < taken.size() && taken_owner[end] == taken_owner[first]; ++end) {
      rest.push_back(value_of(taken[end].functional, shape.rest->control));
      target.push_back(taken[end].target);
    }
    for (const SculptField& local : fields_of((*shape.icons)[taken_owner[first]], shape, rest, target)) {
      SculptField field{std::vector<double>(taken.size(), 0.0), local.amount};
      for (std::size_t i = first; i < end; ++i) field.weight[pin_of[i]] = local.weight[i - first];
      result.fields.push_back(std::move(field));
    }
    first = end;
  }
  return result;
}

double pin_off(const PinnedIcons& pinned, std::size_t pin, const std::vector<Vec3>& control) {
  const std::size_t points = pinned.pins.points.size();
  const Vec3 place =
      pin < points ? control[pinned.pins.points[pin]] : value_of(pinned.pins.rows[pin - points], control);
  return (place - pinned.target[pin]).norm();
}

}  // namespace handloft::model
