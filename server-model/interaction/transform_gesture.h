#pragma once
// With "Move" switched on, a hand takes a whole shape along (A28: surfaces can be translated). A closed hand
// moves it with the fist's centre, turns it as the fist turns, and scales it as the potentiometer is turned;
// a pointing hand moves it with the fingertip, without turning. It holds the selected shape when one is
// selected, wherever that is; else the nearest within reach.

#include <optional>
#include <string>

#include "server-model/interaction/air_operation.h"
#include "server-model/interaction/fist_hold.h"
#include "server-model/interaction/gesture.h"
#include "server-model/interaction/workbench.h"

namespace handloft::interaction {

class TransformGesture final : public Gesture {
 public:
  enum class Grip { fist, fingertip };

  /// `workbench` must outlive it.
  TransformGesture(Workbench& workbench, Grip grip)
      : workbench_(workbench), grip_(grip), air_(workbench), fist_(workbench.options.fist_hold) {}

  Result<Preview> on_frame(const HandFrame& frame) override;
  void let_go(std::optional<TimePoint> since) override;
  Result<std::optional<model::Submitted>> commit() override;
  void cancel() override { air_.cancel(); }
  bool begun() const override { return air_.operation().has_transform(); }
  HandActivity activity() const override;
  std::string_view name() const override { return "move"; }

 private:
  v1::Operation operation(const FistWay& way) const;
  double scale_for(double potentiometer) const;

  Workbench& workbench_;
  Grip grip_;
  AirOperation air_;
  std::string entity_;  ///< Empty: nothing is held yet.
  Eigen::Vector3d pivot_ = Eigen::Vector3d::Zero();
  FistHold fist_;
  bool let_go_ = false;
  std::optional<TimePoint> opened_;  ///< When the fist let it go.
  double dial_ = 0;                  ///< Of the potentiometer when the hand took hold.
  std::optional<Eigen::Vector3d> last_;
};

}  // namespace handloft::interaction
