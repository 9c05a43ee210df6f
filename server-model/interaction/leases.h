#pragma once
// Soft leases (U1): while one client shapes an entity continuously, others see so and their own continuous
// deformations of it are refused, with who it is and for how long. A lease comes with a gesture of a hand and
// lasts as long, or is asked for (Envelope.lease) and lasts five seconds unless it is asked for again. It
// ends by itself when nothing is heard, and with the connection. Properties are not leased: the last writer
// wins.

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "proto/operation.pb.h"

namespace handloft::interaction {

/// The entities that an operation deforms continuously: pushes, profiles, drags of icons, moves of points and
/// of whole shapes. Ascending, each once. Empty: it may be done whoever shapes what.
std::vector<std::string> deformed_entities(const v1::Operation& operation);

struct LeaseOptions {
  Duration lasts = std::chrono::seconds(5);  ///< From the last frame of a gesture, or since it was asked for.
  std::size_t max_asked = 64;                ///< Entities that one client may have asked for at a time.
};

struct Lease {
  std::uint64_t client_id = 0;  ///< 0: the hand that the server's own tracking follows.
  std::string name;
  bool operator==(const Lease&) const = default;
};

/// Of one model. Not thread-safe: owned by the model's thread.
class Leases {
 public:
  enum class Kind : std::uint8_t { gesture, asked };

  /// `now`: the clock; empty: one that stands still.
  explicit Leases(std::function<TimePoint()> now = {}, LeaseOptions options = {});

  /// What a client is called in refusals and shown as.
  void introduce(std::uint64_t client_id, std::string name);
  /// Takes or renews. Errors: failed_precondition, while it is somebody else's, with whose and for how long;
  /// resource_exhausted beyond max_asked.
  Status take(const std::string& entity, std::uint64_t client_id, Kind kind);
  /// Nothing happens where it is not this client's.
  void release(const std::string& entity, std::uint64_t client_id, Kind kind);
  /// The client may shape nothing any more.
  void release_all(std::uint64_t client_id);
  /// The client is gone.
  void forget(std::uint64_t client_id);
  /// Whether the client may deform it now. Errors: as take().
  Status check(const std::string& entity, std::uint64_t client_id) const;
  /// The first refusal of all that the operation deforms.
  Status check(const v1::Operation& operation) const;

  /// By entity, those that have not ended.
  std::map<std::string, Lease> current() const;
  /// Forgets those that have ended; true: there were some.
  bool sweep();

 private:
  struct Held {
    std::uint64_t client_id = 0;
    TimePoint gesture_until = TimePoint::min();
    TimePoint asked_until = TimePoint::min();
    TimePoint until() const { return std::max(gesture_until, asked_until); }
  };
  std::string name_of(std::uint64_t client_id) const;

  std::function<TimePoint()> now_;
  LeaseOptions options_;
  std::map<std::string, Held> held_;
  std::map<std::uint64_t, std::string> names_;
};

}  // namespace handloft::interaction
