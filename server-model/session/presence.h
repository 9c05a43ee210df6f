#pragma once
// Presence on its way from one to the others (reliability S1): what a peer says of itself is passed on only
// as far as it is well-formed, and without what nobody draws.

#include <cstdint>
#include <optional>
#include <string>

#include "common/base/log.h"
#include "proto/scene.pb.h"
#include "proto/tracking.pb.h"
#include "server-model/interaction/interaction.h"

namespace handloft::session {

/// `presence` without covariances, devices' raw values and anything that is not a finite number (a fingertip
/// or head with such a number becomes LOST; a disk, plane or curve goes); strings cut to 256 bytes, at most
/// five fingertips, 64 selected entities, a curve of at most 1024 points or none.
v1::Presence clean_presence(v1::Presence presence);

/// Whose hands they are.
struct HandOwner {
  std::uint64_t client_id = 0;     ///< 0: the server's own tracking.
  std::string name = "hand";       ///< Shown to others.
  std::optional<Logger> log = {};  ///< Says in its lines which client it is; nullopt: the model's own.
};

/// What others call one of its hands, from 0: two of them have two names.
std::string hand_name(const HandOwner& owner, int hand);

/// What a hand of `frame` does, for viewers: the hand and the head themselves, the tool in words, the
/// modification disk (A13), the potentiometer's range (A16), the curve being drawn (its points made fewer
/// when there are more than a viewer can tell apart), the symmetry plane (A12) and what pointing does, or
/// with a sculpted surface active which icon is selected or added. The entity is the one that the hand acts
/// on; of a client's hand that acts on none its active shape. `hand` counts from 0 and may be one that the
/// frame does not have.
v1::Presence hand_presence(const v1::TrackingFrame& frame, int hand,
                           const interaction::Interaction& interaction, const HandOwner& owner = {});

/// The pulse that the glove gives: faint and 60 ms at the most, so that it is felt and not heard, nor seen in
/// the fingertips' places. A refusal is the strongest and longest.
v1::GloveFeedback glove_feedback(interaction::Pulse pulse);

}  // namespace handloft::session
