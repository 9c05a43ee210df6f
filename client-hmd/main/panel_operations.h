#pragma once
// What a panel's request is in the one vocabulary of change (proto/operation.proto).

#include <optional>

#include "client-hmd/hud/panel_requests.h"
#include "proto/operation.pb.h"

namespace handloft::client {

/// Nothing for requests that do not change the model: of the view, settings, the hand, questions.
std::optional<v1::Operation> operation_of(const PanelRequest& request);

}  // namespace handloft::client
