#pragma once
// What the palette's cells for sculpting do (D18, D19). Those of icons act on the selected one, a step at
// each touch; with none selected, role and property are set for the icons that come.

#include <string>
#include <string_view>

#include "server-model/interaction/command.h"
#include "server-model/interaction/workbench.h"

namespace handloft::interaction {

class SculptCommands {
 public:
  /// `workbench` must outlive it.
  explicit SculptCommands(Workbench& workbench) : workbench_(workbench) {}

  /// The active shape's surface, exactly when it is fitted and within a tolerance when it has only points; a
  /// flat sheet when no shape is active. It is what gestures act on then.
  CommandAnswer make_surface(FrameOutcome& outcome);
  CommandAnswer commit(FrameOutcome& outcome);   ///< D19
  CommandAnswer recover(FrameOutcome& outcome);  ///< D19
  CommandAnswer step_pen();                      ///< Points and curves, or regions.
  CommandAnswer step_property(FrameOutcome& outcome);
  CommandAnswer step_role(FrameOutcome& outcome);
  CommandAnswer step_state(FrameOutcome& outcome);
  /// Of a driving load: following the hand (D16), soft, stiff: shares of the stiffness that follows it.
  CommandAnswer step_stiffness(FrameOutcome& outcome);
  CommandAnswer delete_icon(FrameOutcome& outcome);

 private:
  CommandAnswer change(std::string words, const v1::ChangeIcon& change, FrameOutcome& outcome);

  Workbench& workbench_;
};

/// What is chosen, for presence: the selected icon, else what new icons of the active sculpted surface get;
/// empty while none is active.
std::string sculpting_words(const Workbench& workbench);

/// "position", "R", "V", "R2", "V2", "RV", "normal"
std::string_view property_words(v1::IconProperty property);

}  // namespace handloft::interaction
