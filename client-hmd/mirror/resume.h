#pragma once
// From one server's scene to the next without a flicker (V5): a scene begins with a snapshot, but large
// clouds follow in pieces and surfaces when they are tessellated. Until what comes shows at least what was
// shown, or for half a second, the former scene stays on the screen. A client that comes back to the same
// server says what it holds, and is sent what differs (U3).

#include <memory>

#include "client-hmd/mirror/scene.h"
#include "common/base/clock.h"
#include "proto/session.pb.h"

namespace handloft::client {

/// Whether every entity of `former` is in `next` with as many points at least and, where it had one, with a
/// surface.
bool covers(const Scene& former, const Scene& next);

/// A Join that resumes from `held`: its epoch, and what it has of each entity.
v1::Join join_with(const Scene& held);

class Resumption {
 public:
  /// The longest that a former scene outlives a snapshot that lacks some of it: a server that lost it must be
  /// seen to have lost it, and all is back within a second.
  static constexpr Duration longest = std::chrono::milliseconds(500);

  /// A snapshot was applied at `now`, while something else was shown.
  void begin(TimePoint now) { until_ = now + longest; }
  /// What to show of the `former` scene and the `newest`.
  std::shared_ptr<const Scene> choose(const std::shared_ptr<const Scene>& former,
                                      const std::shared_ptr<const Scene>& newest, TimePoint now);
  /// The moment from which the newest is shown in any case.
  TimePoint until() const { return until_; }

 private:
  TimePoint until_;
};

}  // namespace handloft::client
