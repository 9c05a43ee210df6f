#pragma once
// A disk in memory under SQLite (an sqlite3_vfs) that can do what disks do at the worst moment: fail, be
// full, write half, and forget or reorder what was not flushed when the power goes. It keeps every write and
// flush in order, so that the state after a crash at any of them can be made afterwards from one run. One
// thread; connections one after another, or to different files.

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace handloft::test {

class FaultDisk {
 public:
  using Files = std::map<std::string, std::string>;

  struct Event {
    enum class Kind { write, truncate, flush, remove };
    Kind kind = Kind::write;
    std::string file;
    std::size_t offset = 0;  ///< Of a truncate: the new size.
    std::string data;
  };

  enum class Failure {
    none,
    error,           ///< Once: writes and flushes answer that the device failed.
    torn_error,      ///< The same, and half of the write happens.
    full_for_good,   ///< From then on there is no space.
    error_for_good,  ///< From then on the device fails.
    read_error,      ///< Once: of reads, counted apart.
    call_error,      ///< Once: of all other calls (opening, locks, sizes, shared memory), counted apart.
  };

  explicit FaultDisk(Files files = {});
  ~FaultDisk();
  FaultDisk(const FaultDisk&) = delete;
  FaultDisk& operator=(const FaultDisk&) = delete;

  /// For LogOptions::vfs.
  const std::string& name() const;
  /// At the index-th write, truncate or flush (or read, or other call) from now.
  void fail_at(std::size_t index, Failure failure);
  std::size_t reads() const;
  std::size_t calls() const;
  const std::vector<Event>& events() const;
  Files files() const;

  struct State;

 private:
  std::unique_ptr<State> state_;
};

/// What is on the disk when all ends at an event.
enum class Crash {
  process_dies,  ///< All before it happened, and half of itself.
  power_fails,   ///< All that was not flushed is gone.
  reorders,      ///< Of what was not flushed each block of 512 bytes is there or not, by chance.
};
FaultDisk::Files after_crash(const FaultDisk::Files& before, const std::vector<FaultDisk::Event>& events,
                             std::size_t end, Crash crash, std::uint64_t seed);

}  // namespace handloft::test
