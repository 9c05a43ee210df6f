#pragma once
// One entity of the wire (scene.proto), checked and applied to what is held. Every count is held against the
// room that is left before anything is allocated for it. Parts that did not change are shared with what was
// shown before, bit for bit, so that a scene that comes again as it was costs the graphics card nothing and
// cannot flicker (V5).

#include <cstdint>
#include <memory>

#include "client-hmd/mirror/limits.h"
#include "client-hmd/mirror/scene.h"
#include "common/base/result.h"
#include "proto/scene.pb.h"

namespace handloft::client {

/// What there was of an entity; either may be null.
struct EntityBefore {
  const Entity* base = nullptr;   ///< What the message builds on: null in a snapshot.
  const Entity* shown = nullptr;  ///< What its parts are shared with where they are equal.
};

/// Numbers sets of triangles (SurfaceMesh::topology). What a server says of its own numbers is not trusted:
/// the same one may come with other triangles, by malice or from a server that began anew.
class TopologyNumbers {
 public:
  std::uint64_t next() { return ++last_; }

 private:
  std::uint64_t last_ = 0;
};

/// Errors: data_corrupt or resource_exhausted, naming the field.
Result<std::shared_ptr<const Entity>> read_entity(const EntityBefore& before, const v1::EntityState& state,
                                                  const MirrorLimits& room, TopologyNumbers& topologies);

}  // namespace handloft::client
