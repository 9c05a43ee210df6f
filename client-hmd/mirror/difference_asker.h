#pragma once
// What was done between two versions (U6) is asked for, not streamed: one question at a time, the newest
// counts.

#include <cstdint>
#include <optional>
#include <string>

#include "client-hmd/mirror/shared_work.h"
#include "proto/session.pb.h"

namespace handloft::client {

struct DifferenceLimits {
  int max_sentences = 100;               ///< Of an answer; more are counted.
  std::size_t max_sentence_bytes = 512;  ///< Longer ones are cut.
};

/// One thread.
class DifferenceAsker {
 public:
  /// Its requests are numbered from `first_request`, so that a connection's other questions are told apart.
  explicit DifferenceAsker(std::uint64_t first_request = 2'000'000'000) : next_request_(first_request) {}

  /// What to send. Earlier answers that still come are to no question of ours.
  v1::Envelope question(const std::string& from, const std::string& to);
  /// An answer from the server; false when it is not to the newest question.
  bool take(const v1::Answer& answer, const DifferenceLimits& limits = {});
  /// The question was not sent, or the connection broke. True: there was one.
  bool abandon(const std::string& why);

  /// Null before the first question.
  const std::optional<VersionDifference>& newest() const { return newest_; }

 private:
  std::uint64_t next_request_;
  std::uint64_t asked_ = 0;  ///< Under way; 0: none.
  std::optional<VersionDifference> newest_;
};

}  // namespace handloft::client
