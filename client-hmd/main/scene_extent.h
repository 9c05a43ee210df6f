#pragma once
// The places that a picture of the whole scene must hold.

#include <glm/glm.hpp>
#include <vector>

#include "client-hmd/mirror/scene.h"

namespace handloft::client {

/// Points and curves that are shown, the vertices of surfaces where they are half opaque or more (A26), of
/// shapes and references, and icons with their arrows (D17). World, metres.
std::vector<glm::dvec3> visible_places(const Scene& scene);

}  // namespace handloft::client
