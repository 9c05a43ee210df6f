#pragma once
// The report of a session: what the model was at the end and how it came about, as JSON for people and tests.

#include <filesystem>
#include <string>

#include "common/base/result.h"
#include "server-model/session/latency.h"
#include "server-model/session/model_actor.h"

namespace handloft::session {

struct SessionFigures {
  ActorState state;
  std::uint64_t clients_served = 0;
  LatencySummary capture_to_delta;
};

/// {"hash":..., "sequence":..., "entity_count":..., "point_count":...,
/// "entities":[{"id","name","points","fitted","degree",
/// "residual_rms_m","residual_max_m","symmetry","partner"}],
/// "tracking":{"frames","gaps","resets","frames_ignored",...}, "client_hands":{...}, "gestures":{...},
/// "meshes":{...}, "latency":{...}}. Lengths in metres.
std::string report_json(const SessionFigures& figures);

/// Writes to a temporary file beside it and renames. Errors: io, naming the path.
Status write_report(const std::filesystem::path& path, const SessionFigures& figures);

}  // namespace handloft::session
