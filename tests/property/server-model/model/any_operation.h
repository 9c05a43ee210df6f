#pragma once
// Generators that the property tests of the model share: numbers and names full-sized from the first case on
// (short sequences of zeros find nothing), mostly ordinary, sometimes what must be refused.

#include <rapidcheck.h>

#include <cstdlib>
#include <limits>
#include <string>

#include "proto/geometry.pb.h"

namespace handloft::model::test {

/// The same sequences each time, so that a failure is the change's; set RC_PARAMS="seed=N" for others. Before
/// main(), since RapidCheck reads it once, at the first property of the program.
inline const bool seeded = [] {
  constexpr int keep_the_callers = 0;
  return setenv("RC_PARAMS", "seed=20", keep_the_callers) == 0;
}();

inline int in_range(int from, int below) {
  constexpr int full_size = 100;
  return *rc::gen::resize(full_size, rc::gen::inRange(from, below));
}

/// Metres; one in `bad_one_in` is absurd.
inline double any_length(int bad_one_in) {
  if (in_range(0, bad_one_in) == 0) {
    return *rc::gen::element(std::numeric_limits<double>::quiet_NaN(),
                             std::numeric_limits<double>::infinity(), -1e300, 1e9, 5e-324);
  }
  return 1e-3 * in_range(-200, 200);
}

inline handloft::v1::Vec3 any_vector(int bad_one_in) {
  handloft::v1::Vec3 vector;
  vector.set_x(any_length(bad_one_in));
  vector.set_y(any_length(bad_one_in));
  vector.set_z(any_length(bad_one_in));
  return vector;
}

}  // namespace handloft::model::test
