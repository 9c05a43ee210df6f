#pragma once
// Requests under way to the model server, and what became of those that are not any more. Bounded: a server
// that never answers costs no memory, and who asks on is told so. Thread-safe.

#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "client-hmd/mirror/acknowledgement.h"
#include "common/base/result.h"

namespace handloft::client {

class PendingRequests {
 public:
  static constexpr std::size_t most = 256;

  /// A number that was not given before; from 1.
  std::uint64_t next();
  /// Errors: resource_exhausted when too many are under way.
  Status add(std::uint64_t number, std::string what);
  /// It was not sent after all.
  void forget(std::uint64_t number);
  /// False: no such request is under way.
  bool answer(std::uint64_t number, std::string refusal, std::vector<std::string> notes);
  /// All that are under way are refused.
  void abandon(const std::string& refusal);
  /// What was answered since the last time, oldest first; the oldest are lost beyond `most`.
  std::vector<Acknowledgement> take();

 private:
  void keep(Acknowledgement acknowledgement);

  std::mutex mutex_;
  std::uint64_t last_ = 0;
  std::map<std::uint64_t, std::string> under_way_;
  std::vector<Acknowledgement> answered_;
};

}  // namespace handloft::client
