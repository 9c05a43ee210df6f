#include "server-model/session/parallel.h"

#include <tbb/parallel_for.h>

#include <cstddef>
#include <functional>

namespace handloft::model {

geometry::ParallelFor parallel_on_all_cores() {
  return [](std::size_t count, const std::function<void(std::size_t)>& task) {
    tbb::parallel_for(std::size_t{0}, count, task);
  };
}

ApplyContext context_on_all_cores() {
  ApplyContext context;
  context.parallel = parallel_on_all_cores();
  return context;
}

}  // namespace handloft::model
