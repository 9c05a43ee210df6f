#pragma once
// What is wrong with a log, in words: every record against its checksum and its place in the chain, the
// sequence without gaps, SQLite's own structures, the rules of undo, the audit trail, the snapshots, and
// the mark of what was durable (D4). Only reads.

#include <cstdint>
#include <string>
#include <vector>

#include "server-model/store/operation_log.h"

namespace handloft::store {

struct Damage {
  std::string where;  ///< "operation 57", "snapshot at 1000", "file"
  std::string what;   ///< What was found and what was expected.
  std::string words() const { return where + ": " + what; }
};

struct LogCheck {
  std::uint64_t operations = 0;     ///< Good ones.
  std::uint64_t good_sequence = 0;  ///< Up to here every record is good.
  std::vector<Damage> damages;      ///< At most max_damages; empty: none.
  /// Snapshots that can not be used. The operations are all there, so nothing is lost, and the log is not
  /// damaged.
  std::vector<Damage> bad_snapshots;

  static constexpr std::size_t max_damages = 100;
  bool good() const { return damages.empty(); }
};

/// O(file). 100,000 small operations take a third of a second.
LogCheck check_log(const OperationLog& log);

}  // namespace handloft::store
