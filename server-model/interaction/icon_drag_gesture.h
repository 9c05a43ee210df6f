#pragma once
// The closed hand near an icon of a sculpted surface holds it (D19, step 4): the icon goes along with the
// fist's centre and turns, about its own place, as the fist turns; the surface follows every frame. All of it
// is one DragIcon from where the hand closed. Nothing happens before the fist has really moved, so that an
// icon may be picked without being nudged. What is not driven by a hand is only selected.
//
// The way begins where the fist has folded, and is committed as it was before it unfolded (fist_hold.h).
//
// A curve icon goes along whole while the potentiometer is turned all the way up. Turned down it bends: the
// place that was nearest to the fist as it closed goes along, and the drag reaches as far along the curve to
// both sides as that share of its length (eq. 4's falloff); a bent curve does not turn. The potentiometer may
// be turned while the hand holds.
//
// Where the model refuses a frame (constraints would contradict each other, D20) the last good one stays, and
// activity() says why.

#include <optional>
#include <string>

#include "common/base/clock.h"
#include "server-model/interaction/air_operation.h"
#include "server-model/interaction/fist_hold.h"
#include "server-model/interaction/gesture.h"
#include "server-model/interaction/workbench.h"

namespace handloft::interaction {

class IconDragGesture final : public Gesture {
 public:
  /// On `picked`, which becomes the selected icon. `workbench` must outlive it.
  IconDragGesture(Workbench& workbench, NearIcon picked);

  Result<Preview> on_frame(const HandFrame& frame) override;
  void let_go(std::optional<TimePoint> since) override;
  Result<std::optional<model::Submitted>> commit() override;
  void cancel() override { air_.cancel(); }
  bool begun() const override { return air_.operation().has_drag_icon(); }
  bool refusing() const override { return !refused_.empty(); }
  HandActivity activity() const override;
  std::string_view name() const override { return "drag"; }

  /// What it holds; empty: it only selected.
  const IconName& held() const { return hold_.name(); }

 private:
  v1::Operation operation(const FistWay& way) const;
  bool moved(const FistWay& way) const;

  Workbench& workbench_;
  NearIcon picked_;
  AirOperation air_;
  IconHold hold_;
  bool curve_ = false;
  bool turns_ = false;   ///< Turning it means anything: not of a position that is held.
  double length_m_ = 0;  ///< Of a curve.
  FistHold fist_;
  bool selected_ = false;  ///< A frame has told so.
  bool let_go_ = false;
  std::optional<TimePoint> opened_;  ///< When it was let go.
  std::string refused_;              ///< Why the last frame was; empty: it was not.
};

}  // namespace handloft::interaction
