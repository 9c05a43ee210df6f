#pragma once
// `handloft-modeld serve`: the command line of session/serve.h.

#include <string>
#include <vector>

#include "common/base/config.h"

namespace handloft::model {

/// `arguments` are the words after "serve". Returns the exit status.
int serve_command(const std::vector<std::string>& arguments);

/// For a command that may be given a server's configuration: what only `serve` reads of it is passed over.
void pass_over_serve_options(OptionTable& table);

}  // namespace handloft::model
