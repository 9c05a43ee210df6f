#pragma once
// Memory of control points, used again: a frame of a drag of a million takes 24 MB, and to get those anew
// from the system takes longer than to fill them.

#include <array>
#include <cstddef>
#include <memory>
#include <mutex>
#include <vector>

#include "server-model/geometry/bspline_surface.h"

namespace handloft::model {

/// Any thread may use it.
class ControlBuffers {
 public:
  /// As many as may be free at a time: a drag has the frame before, which is shown, and the next.
  static constexpr std::size_t max_free = 2;

  /// Memory of a surface of so many points that was let go, with whatever it held; else empty.
  std::vector<geometry::Vec3> take(std::size_t points);
  /// Where the last owner lets go, its control points' memory comes back; after the buffers are gone it is
  /// freed.
  std::shared_ptr<const geometry::BSplineSurface> share(geometry::BSplineSurface surface);

 private:
  struct Free {
    std::mutex mutex;
    std::array<std::vector<geometry::Vec3>, max_free> kept;
    std::size_t next = 0;  ///< The one that gives way.
  };
  std::shared_ptr<Free> free_ = std::make_shared<Free>();
};

}  // namespace handloft::model
