#pragma once
// What a program takes of the machine: for its metrics, and how its memory is kept from spreading.

#include <cstdint>

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

}  // namespace handloft
