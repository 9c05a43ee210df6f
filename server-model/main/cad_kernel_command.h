#pragma once
// `handloft-modeld cad-kernel BYTES SECONDS`: the process behind session/cad_process.h. Takes one request
// (exchange/cad_job.h) from standard input, a socket, until its end, and writes the answer there. Nobody
// calls it by hand, so --help does not tell of it.

#include <string>
#include <vector>

#include "server-model/main/exit_status.h"

namespace handloft::model {

/// `arguments`: the most address space and CPU time that it may take.
ExitStatus cad_kernel_command(const std::vector<std::string>& arguments);

}  // namespace handloft::model
