#include "server-model/interaction/command.h"

#include <utility>

namespace handloft::interaction {

CommandAnswer submit_command(Workbench& workbench, std::string words, const v1::Operation& operation,
                             FrameOutcome& outcome) {
  v1::Operation own = operation;
  own.set_client_id(workbench.client_id);
  auto submitted = workbench.model.submit(own);
  if (!submitted) {
    outcome.problems.push_back("command refused: " + submitted.error().describe());
    return {std::move(words), submitted.error().message, submitted.error().code};
  }
  outcome.scene_changed = true;
  outcome.submitted.push_back(std::move(*submitted));
  return {std::move(words), {}};
}

}  // namespace handloft::interaction
