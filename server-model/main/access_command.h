#pragma once
// `handloft-modeld invite|users|role|revoke|audit`: the people of a server, in its access file and beside it
// while it runs (access/README.md). `handloft-modeld pair`: this device, with a server.

#include <string>
#include <vector>

#include "server-model/main/exit_status.h"

namespace handloft::model {

/// The names above.
bool is_access_command(const std::string& command);

/// `arguments` are the words after the command. Answers go to standard output: for people, or with --json one
/// line of JSON. exit_failed: refused, or a file cannot be read or written.
ExitStatus access_command(const std::string& command, const std::vector<std::string>& arguments);

}  // namespace handloft::model
