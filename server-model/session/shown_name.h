#pragma once
// A name that somebody sent, as it may go back to its sender and into the log.

#include <algorithm>
#include <cstddef>
#include <string>

namespace handloft::session {

/// As much of a name as looks like one: it goes back to its sender.
inline std::string shown_name(const std::string& name) {
  constexpr std::size_t longest = 64;
  const auto end = std::find_if(name.begin(), name.end(), [](char c) { return c < ' ' || c > '~'; });
  return name.substr(0, std::min(longest, static_cast<std::size_t>(end - name.begin())));
}

}  // namespace handloft::session
