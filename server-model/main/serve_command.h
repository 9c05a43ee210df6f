#pragma once
// `handloft-modeld serve`: the command line of session/serve.h.

#include <string>
#include <vector>

namespace handloft::model {

/// `arguments` are the words after "serve". Returns the exit status.
int serve_command(const std::vector<std::string>& arguments);

}  // namespace handloft::model
