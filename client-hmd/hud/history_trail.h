#pragma once
// The names of steps that were taken or taken back. The server tells only the next of either; what passed by
// while this client looked on is remembered here, and the rest is told as a count.

#include <cstdint>
#include <string>
#include <vector>

#include "client-hmd/mirror/scene.h"

namespace handloft::client {

struct HistoryRows {
  std::uint32_t undo_steps = 0, redo_steps = 0;
  std::vector<std::string> undo;  ///< Next first, as far as they are known; at most HistoryTrail::longest.
  std::vector<std::string> redo;
};

class HistoryTrail {
 public:
  static constexpr std::size_t longest = 20;  ///< Rows: nobody counts farther back.

  /// With every scene that is shown. Another epoch forgets everything.
  void follow(const Scene& scene);
  HistoryRows rows() const;

 private:
  std::uint64_t epoch_ = 0;
  History last_;
  std::vector<std::string> undo_;  ///< By depth: undo_[i] is step i + 1; empty: not known.
  std::vector<std::string> redo_;
};

}  // namespace handloft::client
