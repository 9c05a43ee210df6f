#pragma once
// How handloft-modeld ends; said by --help too.

namespace handloft::model {

enum ExitStatus : int {
  exit_ok = 0,
  exit_failed = 1,  ///< A script line failed, or the server stopped with an error.
  exit_usage =
      2,  ///< The command line or a configuration file is wrong, or a script or server can't be reached.
};

}  // namespace handloft::model
