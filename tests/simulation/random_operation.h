#pragma once
// What people might do next to the scene that they see: mostly sensible, sometimes late (what it names is
// gone by then), sometimes nonsense that must be refused.

#include "client-hmd/mirror/scene.h"
#include "proto/operation.pb.h"
#include "tests/simulation/timeline.h"

namespace handloft::simulation {

struct OperationMix {
  double nonsense = 0.05;  ///< Of all operations.
  double undo = 0.15;      ///< And redo: a third as often.
  double sculpting = 0.05;
  double words = 0.05;  ///< Versions and comments.
};

v1::Operation random_operation(const client::Scene& seen, Random& random, const OperationMix& mix);

}  // namespace handloft::simulation
