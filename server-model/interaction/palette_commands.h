#pragma once
// What touching a cell of the palette does (A25: the hand on the table switches modes and adjusts what is
// seen). Commands act on the active shape (workbench.h); every one that changes the document is one
// operation. The exponent's cell is a gesture of its own (exponent_gesture.h); those for sculpting are in
// sculpt_commands.h.

#include <string>

#include "common/base/table_palette.h"
#include "server-model/interaction/command.h"
#include "server-model/interaction/frame_outcome.h"
#include "server-model/interaction/sculpt_commands.h"
#include "server-model/interaction/workbench.h"

namespace handloft::interaction {

class PaletteCommands {
 public:
  /// `workbench` must outlive it.
  explicit PaletteCommands(Workbench& workbench) : workbench_(workbench), sculpt_(workbench) {}

  /// What the model did and refused is added to `outcome`.
  CommandAnswer run(PaletteCommand command, FrameOutcome& outcome);

 private:
  CommandAnswer submit(std::string words, const v1::Operation& operation, FrameOutcome& outcome);
  CommandAnswer show(std::string words, v1::Representation representation, FrameOutcome& outcome);
  CommandAnswer fit(FrameOutcome& outcome);
  CommandAnswer toggle_representation(FrameOutcome& outcome);
  CommandAnswer new_shape(FrameOutcome& outcome);
  CommandAnswer step_symmetry();
  CommandAnswer step_degree(FrameOutcome& outcome);
  CommandAnswer step_trim_mode();
  CommandAnswer toggle_keep_curve();
  CommandAnswer toggle_falloff();
  CommandAnswer next_page();
  CommandAnswer toggle_move();
  CommandAnswer select_next(FrameOutcome& outcome);
  CommandAnswer select_nearest(FrameOutcome& outcome);
  CommandAnswer duplicate(FrameOutcome& outcome);
  CommandAnswer next_alternative(FrameOutcome& outcome);
  /// Fills the degree of a fit as the palette has it.
  void set_degree(v1::Fit& fit) const;

  Workbench& workbench_;
  SculptCommands sculpt_;
};

}  // namespace handloft::interaction
