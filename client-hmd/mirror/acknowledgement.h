#pragma once
// What became of something that was asked of the model server.

#include <string>
#include <vector>

namespace handloft::client {

struct Acknowledgement {
  std::string what;     ///< The command's name ("fit"), or the operation's kind.
  std::string refusal;  ///< Why it was refused, in words; empty: done.
  std::vector<std::string> notes;
};

}  // namespace handloft::client
