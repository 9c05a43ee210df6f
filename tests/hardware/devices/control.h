#pragma once
// How a test drives a device of its own making: one command a line on the device's standard input, one line
// of what the computer did on its standard output. "plug" and "unplug" are common to all; the end of the
// input unplugs and ends.

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <sstream>
#include <string>
#include <vector>

#include "common/base/clock.h"

namespace handloft::test {

/// Standard input in lines, without ever waiting longer than asked.
class Commands {
 public:
  Commands() { ::fcntl(STDIN_FILENO, F_SETFL, ::fcntl(STDIN_FILENO, F_GETFL) | O_NONBLOCK); }

  /// Waits until a line, `more_fd` (-1: none) or `until`. Complete lines, if any came.
  std::vector<std::string> wait(TimePoint until, int more_fd = -1) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - SystemClock().now()).count();
    pollfd waited[2] = {{ended_ ? -1 : STDIN_FILENO, POLLIN, 0}, {more_fd, POLLIN, 0}};
    (void)::poll(waited, 2, left < 0 ? 0 : static_cast<int>(left));
    std::vector<std::string> lines;
    char bytes[512];
    ssize_t size = 0;
    while (!ended_ && (size = ::read(STDIN_FILENO, bytes, sizeof bytes)) > 0)
      rest_.append(bytes, static_cast<std::size_t>(size));
    if (!ended_ && size == 0) ended_ = true;
    for (auto end = rest_.find('\n'); end != std::string::npos; end = rest_.find('\n')) {
      lines.push_back(rest_.substr(0, end));
      rest_.erase(0, end + 1);
    }
    return lines;
  }
  bool ended() const { return ended_; }

 private:
  std::string rest_;
  bool ended_ = false;
};

inline void say(const std::string& line) {
  std::puts(line.c_str());
  std::fflush(stdout);
}

[[noreturn]] inline void give_up(const std::string& what) {
  std::perror(what.c_str());
  std::_Exit(2);
}

}  // namespace handloft::test
