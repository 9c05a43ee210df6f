#include "common/base/process_figures.h"

#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <string>
#include <vector>

namespace handloft {
namespace {

TEST(ProcessFigures, ThisProcessHasThem) {
  const ProcessFigures figures = process_figures();
  EXPECT_GT(figures.resident_bytes, 1'000'000U);
  EXPECT_GT(figures.open_files, 2U);
  EXPECT_GE(figures.cpu_seconds, 0.0);
}

TEST(ProcessFigures, TheHeapIsWhatIsHeld) {
  if (process_figures().heap_bytes == 0) GTEST_SKIP() << "a sanitizer has a heap of its own";
  constexpr std::size_t piece = 1000, pieces = 100'000;
  const std::uint64_t before = process_figures().heap_bytes;
  std::vector<std::unique_ptr<char[]>> held(pieces);
  for (auto& each : held) each = std::make_unique<char[]>(piece);
  EXPECT_GT(process_figures().heap_bytes, before + piece * pieces);
  EXPECT_LT(process_figures().heap_bytes, before + piece * pieces * 5 / 4);
  held.clear();
  held.shrink_to_fit();
  EXPECT_LT(process_figures().heap_bytes, before + piece * pieces / 10);
}

TEST(ProcessFigures, AsPrometheusReadsThem) {
  MetricsText text;
  add_process_figures(text, {1.5, 4096, 12, 2048});
  const std::string written = text.take();
  for (const char* line :
       {"handloft_process_cpu_seconds_total 1.5", "handloft_process_resident_memory_bytes 4096",
        "handloft_process_heap_bytes 2048", "handloft_process_open_fds 12"})
    EXPECT_NE(written.find(std::string(line) + "\n"), std::string::npos) << line << "\nin\n" << written;
}

// Every other piece is let go, so that none of the heap's end is free: glibc by itself keeps all of it.
TEST(MemoryReturn, GivesBackWhatLiesFreeBetweenWhatIsHeld) {
  if (process_figures().heap_bytes == 0) GTEST_SKIP() << "a sanitizer has a heap of its own";
  MemoryReturn memory;
  EXPECT_EQ(memory.look(), 0U);
  constexpr std::size_t pieces = 4000, piece_bytes = 16'000;
  std::vector<std::unique_ptr<char[]>> held;
  for (std::size_t i = 0; i < pieces; ++i) {
    held.push_back(std::make_unique<char[]>(piece_bytes));
    std::memset(held.back().get(), 1, piece_bytes);
  }
  EXPECT_EQ(memory.look(), 0U) << "all of it is held";
  for (std::size_t i = 0; i < pieces; i += 2) held[i].reset();
  const std::uint64_t resident = process_figures().resident_bytes;
  EXPECT_GT(memory.look(), std::uint64_t{16} << 20U) << "of 32 MB, all but the edges of pieces";
  EXPECT_LT(process_figures().resident_bytes, resident - (std::uint64_t{16} << 20U));
  EXPECT_EQ(memory.look(), 0U) << "and is not tried again";
}

}  // namespace
}  // namespace handloft
