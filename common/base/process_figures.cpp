#include "common/base/process_figures.h"

#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <thread>

namespace handloft {

ProcessFigures process_figures() {
  constexpr double us_per_s = 1e6;
  ProcessFigures figures;
  rusage usage{};
  if (getrusage(RUSAGE_SELF, &usage) == 0) {
    figures.cpu_seconds = static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
                          static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec) / us_per_s;
  }
  std::ifstream statm("/proc/self/statm");
  std::uint64_t all_pages = 0, resident_pages = 0;
  if (statm >> all_pages >> resident_pages)
    figures.resident_bytes = resident_pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  std::error_code gone;
  for (std::filesystem::directory_iterator it("/proc/self/fd", gone), end; !gone && it != end;
       it.increment(gone))
    ++figures.open_files;
  const auto heap = ::mallinfo2();
  figures.heap_bytes = heap.uordblks + heap.hblkhd;
  return figures;
}

void add_process_figures(MetricsText& text, const ProcessFigures& figures) {
  text.family("process_cpu_seconds_total", "counter", "User and system time.");
  text.sample(figures.cpu_seconds);
  text.family("process_resident_memory_bytes", "gauge", "Resident memory.");
  text.sample(figures.resident_bytes);
  text.family("process_heap_bytes", "gauge", "What the program holds of its heap.");
  text.sample(figures.heap_bytes);
  text.family("process_open_fds", "gauge", "Open files.");
  text.sample(figures.open_files);
}

void share_heaps() {
  // Two at least, so that a thread that waits for the machine within malloc does not hold all others.
  ::mallopt(M_ARENA_MAX, static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 2U, 64U)));
}

std::uint64_t MemoryReturn::look() {
  const auto free_now = [] {
    const ProcessFigures figures = process_figures();
    return figures.resident_bytes - std::min(figures.resident_bytes, figures.heap_bytes);
  };
  const std::uint64_t before = free_now();
  least_free_bytes_ = std::min(least_free_bytes_.value_or(before), before);
  if (before - *least_free_bytes_ < worth_bytes) return 0;
  ::malloc_trim(0);
  const std::uint64_t after = free_now();
  least_free_bytes_ = after;  // What cannot be given back is not tried again until there is more.
  return before - std::min(before, after);
}

}  // namespace handloft
