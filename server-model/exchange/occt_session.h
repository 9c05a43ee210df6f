#pragma once
// The border to Open CASCADE: its settings and messengers are global, so one call at a time, silent (standard
// output belongs to our answers), and its exceptions become Errors. Not for others than cad_file,
// step_reader and reference_cad.

#include <functional>
#include <mutex>

#include "common/base/result.h"

namespace handloft::exchange::detail {

/// Holds the library for one call.
class OcctSession {
 public:
  OcctSession();

 private:
  std::unique_lock<std::mutex> lock_;
};

/// Runs `work`; an exception of the library or of memory becomes an Error with `doing` in its message.
Status guarded(const char* doing, const std::function<Status()>& work);

}  // namespace handloft::exchange::detail
