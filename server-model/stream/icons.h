#pragma once
// The icons of sculpted surfaces as viewers get them (D6 - D14, D17): with the paper's colours, so that all
// viewers agree.

#include <cstdint>

#include "proto/scene.pb.h"
#include "server-model/model/sculpt_shape.h"
#include "server-model/stream/scene.h"

namespace handloft::stream {

/// As the paper has them: what sleeps is grey, loads are green, derivatives yellow, other constraints red.
std::uint32_t icon_colour_rgba(const model::SculptIcon& icon);

/// Whether what viewers see of the icons may differ; `before` may hold no sculpted surface.
bool icons_differ(const SceneEntity& before, const SceneEntity& after);

/// Writes the whole set into `state` and says so (icons_shown). Precondition: a sculpted surface.
void write_icons(const SceneEntity& entity, v1::EntityState& state);

}  // namespace handloft::stream
