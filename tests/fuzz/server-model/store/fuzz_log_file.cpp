// Any bytes as a model's file (F1, D4): it opens or is refused, and is checked, read, recovered and repaired
// without a crash; what is served afterwards is a chain of good records, and looking writes nothing. The last
// input bytes may be a write-ahead log: the first four say (little-endian) how many bytes of the input are
// one.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "server-model/store/log_check.h"
#include "server-model/store/operation_log.h"
#include "server-model/store/recovery.h"
#include "server-model/store/repair.h"
#include "tests/support/fault_disk.h"

namespace {

namespace store = handloft::store;
using Access = store::OperationLog::Access;

constexpr const char* file = "model.handloft";

void require(bool good) {
  if (!good) std::abort();
}

store::LogOptions on(const handloft::test::FaultDisk& disk) {
  store::LogOptions options;
  options.vfs = disk.name();
  options.mark = store::LogOptions::Mark::none;
  return options;
}

/// Operations that can be read in order; each visit checks that nothing is left out.
std::uint64_t readable(const store::OperationLog& log) {
  std::uint64_t expected = 1;
  (void)log.read(1, [&](const store::LogEntry& entry) -> handloft::Status {
    require(entry.record.sequence == expected);
    ++expected;
    return {};
  });
  return expected - 1;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t head = 4;
  if (size < head) return 0;
  std::size_t ahead = 0;
  for (std::size_t i = 0; i < head; ++i) ahead |= static_cast<std::size_t>(data[i]) << (8 * i);
  const std::string bytes(reinterpret_cast<const char*>(data + head), size - head);
  handloft::test::FaultDisk::Files files;
  if (ahead <= bytes.size()) {
    files[file] = bytes.substr(0, bytes.size() - ahead);
    if (ahead > 0) files[std::string(file) + "-wal"] = bytes.substr(bytes.size() - ahead);
  } else {
    files[file] = bytes;
  }
  const handloft::test::FaultDisk disk(files);
  {
    auto log = store::OperationLog::open(file, Access::read, on(disk));
    if (log) {
      const store::LogCheck check = store::check_log(*log);
      require(check.damages.size() <= store::LogCheck::max_damages);
      (void)readable(*log);
      (void)log->read_rules();
      (void)log->audit();
      (void)store::recover(*log);
    }
  }
  // What was good of it is a log that opens.
  if (const auto repaired = store::repair(file, "repaired.handloft", on(disk)); repaired) {
    auto log = store::OperationLog::open("repaired.handloft", Access::read, on(disk));
    require(log.ok() && readable(*log) == repaired->operations);
  }
  // A damaged one is never opened for writing.
  if (auto log = store::OperationLog::open(file, Access::write, on(disk)); log)
    require(store::check_log(*log).good());
  return 0;
}
