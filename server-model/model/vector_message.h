#pragma once
// Points and directions into messages.

#include "proto/geometry.pb.h"
#include "server-model/geometry/types.h"

namespace handloft::model {

inline void write_vector(const geometry::Vec3& from, handloft::v1::Vec3& to) {
  to.set_x(from.x());
  to.set_y(from.y());
  to.set_z(from.z());
}

inline void write_vector(const geometry::Vec2& from, handloft::v1::Vec2& to) {
  to.set_x(from.x());
  to.set_y(from.y());
}

}  // namespace handloft::model
