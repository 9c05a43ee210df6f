#pragma once
// The random bytes by which a model server knows this person's client again (U1): to undo, to resume and to
// retry after a restart. Kept in $XDG_STATE_HOME/handloft/client_key, or ~/.local/state/..., for this user
// alone (0600). A second program that runs at the same time is another client: two with the same key would
// end each other's connections.

#include <string>

#include "common/base/log.h"
#include "common/net/endpoint.h"

namespace handloft::client {

class ClientKey {
 public:
  /// Null or empty: not set. What cannot be read or kept is logged, and the key is empty: then the server
  /// sees another client every time.
  static ClientKey open(const char* state_home, const char* home, const Logger& log);

  /// 32 bytes, or none.
  const std::string& bytes() const { return bytes_; }

 private:
  net::FileDescriptor lock_;  ///< Held as long as the key is used.
  std::string bytes_;
};

}  // namespace handloft::client
