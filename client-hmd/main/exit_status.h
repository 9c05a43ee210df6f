#pragma once
// How handloft-hmd ends: for scripts and for whoever started it. The reason is always said on standard error.

#include "common/base/result.h"

namespace handloft::client {

enum ExitStatus : int {
  exit_ok = 0,
  exit_failed = 1,  ///< No server, no display, no picture, a file that cannot be written.
  exit_usage = 2,   ///< The command line is wrong, a pairing code is mistyped.
  exit_refused =
      3,  ///< The server does not let this device in: not paired, a wrong or old code, revoked, no role.
};

inline ExitStatus exit_status(const Status& status) {
  if (status.ok()) return exit_ok;
  if (status.error().code == ErrorCode::permission_denied) return exit_refused;
  return status.error().code == ErrorCode::invalid_argument ? exit_usage : exit_failed;
}

}  // namespace handloft::client
