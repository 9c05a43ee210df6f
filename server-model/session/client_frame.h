#pragma once
// A tracking frame as a client sends it of hands of its own, made one that the model can use: checked,
// without what nobody looks at, and on the server's clock.

#include <cstdint>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "common/net/connection.h"
#include "proto/tracking.pb.h"
#include "server-model/interaction/hand_sample.h"

namespace handloft::session {

/// Two clocks, the same or of two hosts.
struct ClientClock {
  Duration server_minus_client{};

  /// By the hello of a peer: late by the way it took. Times that are none (0, negative, centuries) leave the
  /// clocks alike.
  static ClientClock of(const net::PeerInfo& peer);
  /// What the client calls `client_ns`. What is none, later than `received`, or older than `max_age`, is
  /// `received`: the client's clock was set, or it makes times up.
  TimePoint to_server(std::int64_t client_ns, TimePoint received, Duration max_age) const;
};

struct ClientFrameOptions {
  interaction::SampleLimits limits;
  /// A network that kept frames back this long has lost the hand anyway.
  Duration max_age = std::chrono::seconds(10);
};

/// Two hands at the most, the 3D mouse and, where its numbers are good, the head; no end of a recording.
/// Covariances, devices, cameras and raw values are dropped. Errors: invalid_argument, the field as
/// "tracking.hands[0].pressure"; nothing of such a frame may be used.
Result<v1::TrackingFrame> read_client_frame(const v1::TrackingFrame& frame, const ClientClock& clock,
                                            TimePoint received, const ClientFrameOptions& options = {});

}  // namespace handloft::session
