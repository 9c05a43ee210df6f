#pragma once
// The one operation in the air that a gesture is. Keeps what was asked for, so that the gesture can go on
// when somebody else changed the document beneath it: the model evaluates it anew on the new base, and where
// that failed it is begun once more with all that the hand has done. What it deforms is leased for as long
// (U1, leases.h): while somebody else shapes that, the gesture is refused.

#include <cstdint>
#include <optional>
#include <set>
#include <span>
#include <string>

#include "common/base/result.h"
#include "proto/operation.pb.h"
#include "server-model/interaction/workbench.h"
#include "server-model/model/model.h"

namespace handloft::interaction {

class AirOperation {
 public:
  /// `workbench` must outlive it; its client_id is in every operation of the gesture.
  explicit AirOperation(Workbench& workbench)
      : model_(workbench.model), claims_(workbench.claims), client_id_(workbench.client_id) {}
  ~AirOperation() { cancel(); }
  AirOperation(const AirOperation&) = delete;
  AirOperation& operator=(const AirOperation&) = delete;

  /// Begins it, or replaces it by `operation`. Refused: nothing of the gesture is in the air any more, but
  /// the operation is remembered; the next set() may be accepted again (a curve that is closed by then).
  Status set(v1::Operation operation);
  /// The same, but what is refused leaves in the air, and remembered, what was there before.
  Status amend(v1::Operation operation);
  /// More points of an add_points that was set.
  Status append_points(std::span<const v1::Point> points);
  /// The next pose of a push_points that was set, with the potentiometer as it is now (A16).
  Status push_on(const v1::DiskPose& pose, double range);
  /// One operation, one step of history, or nullopt when it changes nothing; tried once more when the base
  /// took it away. The gesture is over.
  Result<std::optional<model::Submitted>> commit();
  void cancel();

  /// It is in the air now.
  bool live() const { return id_ != 0 && model_.provisional(id_) != nullptr; }
  /// What was asked for last.
  const v1::Operation& operation() const { return operation_; }

 private:
  Status begin();
  /// Takes or renews the leases of what the operation deforms.
  Status lease(const v1::Operation& operation);
  void take_down();
  void release();

  model::Model& model_;
  ClaimsPtr claims_;
  std::uint64_t client_id_;
  model::ProvisionalId id_ = 0;  ///< 0: none.
  v1::Operation operation_;
  std::set<std::string> leased_;
};

}  // namespace handloft::interaction
