#include "server-model/interaction/air_operation.h"

#include <string>
#include <utility>

namespace handloft::interaction {

Status AirOperation::lease(const v1::Operation& operation) {
  for (std::string& id : deformed_entities(operation)) {
    if (Status taken = claims_->leases.take(id, client_id_, Leases::Kind::gesture); !taken) return taken;
    leased_.insert(std::move(id));
  }
  return {};
}

void AirOperation::release() {
  for (const std::string& id : leased_) claims_->leases.release(id, client_id_, Leases::Kind::gesture);
  leased_.clear();
}

Status AirOperation::begin() {
  take_down();
  auto id = model_.begin_provisional(operation_);
  if (!id) return id.error();
  id_ = *id;
  return {};
}

Status AirOperation::set(v1::Operation operation) {
  operation_ = std::move(operation);
  operation_.set_client_id(client_id_);
  if (Status leased = lease(operation_); !leased) {
    cancel();
    return leased;
  }
  if (!live()) return begin();
  auto status = model_.update_provisional(id_, operation_);
  if (!status) take_down();
  return status;
}

Status AirOperation::amend(v1::Operation operation) {
  operation.set_client_id(client_id_);
  if (Status leased = lease(operation); !leased) return leased;
  if (!live()) {
    v1::Operation before = std::exchange(operation_, std::move(operation));
    auto status = begin();
    if (!status) operation_ = std::move(before);
    return status;
  }
  auto status = model_.update_provisional(id_, operation);
  if (status) operation_ = std::move(operation);
  return status;
}

Status AirOperation::append_points(std::span<const v1::Point> points) {
  for (const v1::Point& point : points) *operation_.mutable_add_points()->add_points() = point;
  if (live() && model_.append_provisional(id_, points)) return {};
  return begin();
}

Status AirOperation::push_on(const v1::DiskPose& pose, double range) {
  if (Status leased = lease(operation_); !leased) return leased;
  *operation_.mutable_push_points()->add_path() = pose;
  operation_.mutable_push_points()->set_range(range);
  if (live() && model_.append_disk(id_, std::span(&pose, 1), range)) return {};
  return begin();
}

Result<std::optional<model::Submitted>> AirOperation::commit() {
  // A hand that was silent for too long has lost its lease, maybe to somebody else.
  if (Status leased = lease(operation_); !leased) {
    cancel();
    return leased.error();
  }
  if (!live()) {
    if (auto status = begin(); !status) return status.error();
  }
  release();
  auto submitted = model_.commit_provisional(std::exchange(id_, 0));
  if (!submitted) return submitted.error();
  if (submitted->sequence == 0) return std::optional<model::Submitted>();
  return std::optional(*std::move(submitted));
}

void AirOperation::take_down() {
  if (id_ != 0) model_.cancel_provisional(std::exchange(id_, 0));
}

void AirOperation::cancel() {
  take_down();
  release();
}

}  // namespace handloft::interaction
