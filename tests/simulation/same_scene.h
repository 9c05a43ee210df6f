#pragma once
// C1: whether a client sees what somebody would see who came now, to what the wire rounds.

#include <string>
#include <vector>

#include "client-hmd/mirror/scene.h"
#include "server-model/stream/scene.h"

namespace handloft::simulation {

/// What `found` has otherwise than `served`, in words ("points of \"top\""); empty: nothing.
std::vector<std::string> differences(const client::Scene& found, const stream::Scene& served);

}  // namespace handloft::simulation
