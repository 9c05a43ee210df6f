#include "server-model/model/provisional.h"

#include <utility>

#include "server-model/model/operations/operations.h"
#include "server-model/model/validate.h"

namespace handloft::model {

namespace v1 = handloft::v1;

Provisional::Provisional(Document base, v1::Operation operation, ApplyContext context, ApplyResult applied)
    : base_(std::move(base)),
      operation_(std::move(operation)),
      context_(context),
      applied_(std::move(applied)) {}

Result<Provisional> Provisional::begin(Document base, v1::Operation operation, ApplyContext context) {
  auto applied = apply(base, operation, context);
  if (!applied) return applied.error();
  return Provisional(std::move(base), std::move(operation), context, std::move(*applied));
}

Status Provisional::append(std::span<const v1::Point> points) {
  if (!operation_.has_add_points()) {
    return make_error(ErrorCode::failed_precondition, "points can only be appended to add_points");
  }
  v1::AddPoints& request = *operation_.mutable_add_points();
  const auto before = static_cast<std::size_t>(request.points_size());
  if (before + points.size() > context_.limits.max_points_per_operation) {
    return make_error(ErrorCode::resource_exhausted, "the gesture has too many points", "add_points.points");
  }
  auto read = read_points(points, "points", context_.limits);
  if (!read) return read.error();
  const std::string entity = applied_.effective.add_points().entity();
  if (request.refit() && !live_) live_ = std::make_unique<LiveFit>(applied_.document, entity);
  auto extended = extend_stroke(applied_.document, entity, applied_.effective.add_points().stroke(), *read,
                                request.min_spacing_m(), context_.limits);
  if (!extended) return extended.error();
  for (const v1::Point& point : points) *request.add_points() = point;
  applied_.document = std::move(*extended);
  if (live_) live_->follow(applied_.document);
  applied_.changes = difference(base_, applied_.document);
  return {};
}

Status Provisional::update(v1::Operation operation) {
  auto applied = apply(base_, operation, context_);
  if (!applied) return applied.error();
  operation_ = std::move(operation);
  applied_ = std::move(*applied);
  live_.reset();
  return {};
}

Status Provisional::rebase(Document base) {
  auto applied = apply(base, operation_, context_);
  if (!applied) return applied.error();
  base_ = std::move(base);
  applied_ = std::move(*applied);
  live_.reset();
  return {};
}

}  // namespace handloft::model
