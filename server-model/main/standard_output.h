#pragma once
// What a command answers.

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>

#include "common/base/result.h"

namespace handloft::model {

/// All of `text` to standard output, or io: half an answer must not be taken for one.
inline Status tell(const std::string& text) {
  if (std::fputs(text.c_str(), stdout) >= 0 && std::fflush(stdout) == 0) return {};
  return make_error(ErrorCode::io, std::string("cannot write the answer: ") + std::strerror(errno),
                    "standard output");
}

}  // namespace handloft::model
