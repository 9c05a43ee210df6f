#pragma once
// `handloft-modeld models|history|verify|repair|export`: what lies on the disk, without a server. All only
// read the model's file; repair and export write others.

#include <string>
#include <vector>

#include "server-model/main/exit_status.h"

namespace handloft::model {

/// The names above.
bool is_store_command(const std::string& command);

/// `arguments` are the words after the command. Answers go to standard output: for people, or with --json one
/// line of JSON. exit_failed: the file is damaged, or something can't be read or written. exit_usage: an
/// option is wrong, by itself or for this model.
ExitStatus store_command(const std::string& command, const std::vector<std::string>& arguments);

}  // namespace handloft::model
