#pragma once
// One source of hands on a model: the server's own tracking, or a client that brings hands of its own (V6).
// Each has a workbench of its own: selection, active shape, palette page, modes (A25).

#include <string>
#include <utility>
#include <vector>

#include "common/base/clock.h"
#include "proto/tracking.pb.h"
#include "server-model/interaction/interaction.h"
#include "server-model/session/presence.h"
#include "server-model/stream/scene.h"

namespace handloft::session {

/// Owned by the model's thread.
struct HandSource {
  /// `model` must outlive it; `claims` are those of all sources of the model.
  HandSource(model::Model& model, const interaction::InteractionOptions& options,
             interaction::ClaimsPtr claims, HandOwner its_owner)
      : owner(std::move(its_owner)), interaction(model, options, std::move(claims), owner.client_id) {}

  HandOwner owner;
  interaction::Interaction interaction;
  v1::TrackingFrame last_frame;  ///< That was used: what presence tells between frames.
  TimePoint heard_at;            ///< When its last frame came.
  std::string notice;            ///< What became of an export; empty: nothing to tell.
  TimePoint notice_until;
};

/// Adds what one source points out to what the others do.
void add_marks(const interaction::Interaction& interaction, stream::HandMarks& marks);

}  // namespace handloft::session
