#pragma once
// What a program takes of the machine: for its metrics, and how its memory is kept from spreading.

#include <cstdint>
#include <optional>

#include "common/base/metrics_text.h"

namespace handloft {

/// What the system knows of this process; zeros where /proc is not to be had.
struct ProcessFigures {
  double cpu_seconds = 0.0;
  std::uint64_t resident_bytes = 0;
  std::uint64_t open_files = 0;
  /// What the program holds of its heap; what is resident beyond it is code, stacks and free places.
  std::uint64_t heap_bytes = 0;
};
ProcessFigures process_figures();

/// The families "process_...".
void add_process_figures(MetricsText& text, const ProcessFigures& figures);

/// From now on the threads of this process share as many heaps as there are processors. glibc gives each
/// thread one of its own, up to eight for a processor: where one thread makes what another lets go, as a
/// model's thread and those of the network do, each of them grows until all have what one had needed. To be
/// called before there are threads. Measured by bench_session_load (--operations 400 --no-drag).
void share_heaps();

/// Gives free memory back to the system. In an hour of short-lived messages between lasting ones some
/// megabytes of a heap lie free in places that glibc, which gives back only from a heap's end, keeps. One
/// thread.
class MemoryReturn {
 public:
  /// Less is not worth it.
  static constexpr std::uint64_t worth_bytes = std::uint64_t{1} << 20U;

  /// To be called every minute or so; for 300 MiB it takes a millisecond or two. Gives back when the memory
  /// that is resident and not held has grown by worth_bytes since it last did, or since the first call. How
  /// much; 0: it was not worth it.
  std::uint64_t look();

 private:
  std::optional<std::uint64_t> least_free_bytes_;
};

}  // namespace handloft
