#include "server-model/interaction/command.h"

#include <utility>

namespace handloft::interaction {

CommandAnswer submit_command(Workbench& workbench, std::string words, const v1::Operation& operation,
                             FrameOutcome& outcome) {
  auto submitted = workbench.model.submit(operation);
  if (!submitted) {
    outcome.problems.push_back("command refused: " + submitted.error().describe());
    return {std::move(words), submitted.error().message};
  }
  outcome.scene_changed = true;
  outcome.submitted.push_back(std::move(*submitted));
  return {std::move(words), {}};
}

}  // namespace handloft::interaction
