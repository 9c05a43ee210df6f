#include "server-model/model/control_buffers.h"

#include <utility>

namespace handloft::model {

using geometry::BSplineSurface;
using geometry::Vec3;

std::vector<Vec3> ControlBuffers::take(std::size_t points) {
  const std::lock_guard lock(free_->mutex);
  for (std::vector<Vec3>& buffer : free_->kept)
    if (buffer.size() == points) return std::exchange(buffer, {});
  return {};
}

std::shared_ptr<const BSplineSurface> ControlBuffers::share(BSplineSurface surface) {
  const auto let_go = [free = std::weak_ptr<Free>(free_)](BSplineSurface* mine) noexcept {
    const std::unique_ptr<BSplineSurface> owned(mine);
    const std::shared_ptr<Free> to = free.lock();
    if (!to) return;
    const std::lock_guard lock(to->mutex);
    std::swap(to->kept[to->next], owned->control);
    to->next = (to->next + 1) % max_free;
  };
  return {new BSplineSurface(std::move(surface)), let_go};
}

}  // namespace handloft::model
