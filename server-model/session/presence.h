#pragma once
// Presence on its way from one to the others (reliability S1): what a peer says of itself is passed on only
// as far as it is well-formed, and without what nobody draws.

#include "proto/scene.pb.h"
#include "proto/tracking.pb.h"

namespace handloft::session {

/// `presence` without covariances, devices' raw values and anything that is not a finite number (a fingertip
/// or head with such a number becomes LOST); strings cut to 256 bytes, at most five fingertips.
v1::Presence clean_presence(v1::Presence presence);

}  // namespace handloft::session
