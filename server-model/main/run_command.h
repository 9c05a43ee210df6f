#pragma once
// `handloft-modeld run SCRIPT.jsonl`: a script against a model of its own, or with --connect against a
// running server.

#include <string>
#include <vector>

#include "server-model/main/exit_status.h"

namespace handloft::model {

/// `arguments` are the words after "run". Answers go to standard output, everything else to standard error.
ExitStatus run_command(const std::vector<std::string>& arguments);

}  // namespace handloft::model
