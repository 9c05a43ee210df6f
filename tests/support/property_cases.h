#pragma once
// How many cases RapidCheck takes in a program. To be asked for before main(), in the initializer of a
// variable, since RapidCheck reads RC_PARAMS once, at the first property of the program.

#include <cstdlib>
#include <string>

#include "tests/support/build_kind.h"

namespace handloft::test {

/// Beside what RC_PARAMS says already; a number of cases that it says stays.
inline bool take_cases(int cases) {
  const char* const given = std::getenv("RC_PARAMS");
  std::string parameters = given == nullptr ? "" : given;
  if (parameters.find("max_success") == std::string::npos)
    parameters += " max_success=" + std::to_string(cases);
  return setenv("RC_PARAMS", parameters.c_str(), 1) == 0;
}

/// In a sanitized build, of one seed; whatever RC_PARAMS says stays as it is.
inline bool take_cases_if_sanitized(int cases) {
  constexpr int keep_the_callers = 0;
  const std::string parameters = "seed=20 max_success=" + std::to_string(cases);
  return sanitized && setenv("RC_PARAMS", parameters.c_str(), keep_the_callers) == 0;
}

}  // namespace handloft::test
