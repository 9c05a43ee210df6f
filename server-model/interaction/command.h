#pragma once
// What a command of the palette answers, and how it becomes an operation.

#include <string>

#include "common/base/result.h"
#include "proto/operation.pb.h"
#include "server-model/interaction/frame_outcome.h"
#include "server-model/interaction/workbench.h"

namespace handloft::interaction {

struct CommandAnswer {
  std::string words;    ///< What was done or set: "degree 3", "selected \"Top\"".
  std::string refusal;  ///< Why not; empty: done.
  ErrorCode refused_as = ErrorCode::failed_precondition;  ///< With a refusal.
};

/// One operation, one step of history. What the model did or refused is added to `outcome`.
CommandAnswer submit_command(Workbench& workbench, std::string words, const v1::Operation& operation,
                             FrameOutcome& outcome);

}  // namespace handloft::interaction
