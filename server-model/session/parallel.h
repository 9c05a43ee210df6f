#pragma once
// All cores for the heavy loops of the geometry, which has no threads of its own.

#include "server-model/model/document.h"

namespace handloft::model {

/// On TBB's workers and the calling thread; see geometry::ParallelFor.
geometry::ParallelFor parallel_on_all_cores();

/// How programs apply operations: with the usual limits, on all cores. The results are those of one core.
ApplyContext context_on_all_cores();

}  // namespace handloft::model
