#pragma once
// The seam between a model's actor and its threads: what runs on the model's own thread and what beside it.
// Programs take start_threads(); a simulation gives queues that it steps (tests/simulation). Who injects
// queues injects the clock as well, and must let them run where the actor waits: push_frame() waits for room.

#include <cstddef>
#include <functional>
#include <memory>

#include "common/base/work_queue.h"

namespace handloft::session {

struct ActorThreads {
  std::shared_ptr<WorkQueue> model;  ///< One piece of work after another: that is the total order.
  std::shared_ptr<WorkQueue> pool;   ///< Maybe several at once.
};

/// Called once by each actor, which stops both queues.
using StartActorThreads = std::function<ActorThreads()>;

/// One piece of work after another on a thread of its own.
std::shared_ptr<WorkQueue> start_queue();

/// A thread for the model and `pool_threads` beside it.
ActorThreads start_threads(std::size_t pool_threads);

}  // namespace handloft::session
