#include "client-hmd/main/end_signal.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <system_error>

#include "client-hmd/main/exit_status.h"

namespace handloft::client {
namespace {

constexpr int until_something_comes = -1;

net::FileDescriptor opened(int descriptor, const char* what) {
  if (descriptor < 0) throw std::system_error(errno, std::generic_category(), what);
  return net::FileDescriptor(descriptor);
}

}  // namespace

EndSignal::EndSignal(Logger log) : log_(std::move(log)) {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  signals_ = opened(signalfd(-1, &signals, SFD_NONBLOCK | SFD_CLOEXEC), "signalfd");
  stop_ = opened(eventfd(0, EFD_CLOEXEC), "eventfd");
  thread_ = std::thread([this] { watch(); });
}

EndSignal::~EndSignal() {
  constexpr std::uint64_t one = 1;
  (void)!::write(stop_.get(), &one, sizeof(one));
  thread_.join();
}

bool EndSignal::came() {
  if (!came_) return false;
  noticed_ = true;
  return true;
}

void EndSignal::watch() {
  const auto at_once = [this](const char* why) {
    log_.error("{}: ending at once, without picture and report", why);
    ::_exit(exit_failed);  // The frame loop's thread cannot be reached.
  };
  std::chrono::steady_clock::time_point since;
  while (true) {
    int wait_ms = until_something_comes;
    if (came_) {
      const auto patience = noticed_ ? picture_patience : frame_patience;
      const auto left = since + patience - std::chrono::steady_clock::now();
      if (left <= left.zero()) {
        at_once(noticed_ ? "the last picture was not there 60 s after the signal"
                         : "a frame did not end within 10 s after the signal");
      }
      wait_ms = static_cast<int>(std::chrono::ceil<std::chrono::milliseconds>(left).count());
    }
    std::array<pollfd, 2> waiting{
        {{.fd = signals_.get(), .events = POLLIN, .revents = 0}, {stop_.get(), POLLIN, 0}}};
    const int ready = ::poll(waiting.data(), waiting.size(), wait_ms);
    if (waiting[1].revents != 0) return;
    if (ready <= 0) continue;
    signalfd_siginfo info{};
    if (::read(signals_.get(), &info, sizeof(info)) != static_cast<ssize_t>(sizeof(info))) continue;
    if (came_.exchange(true)) at_once("told to end a second time");
    since = std::chrono::steady_clock::now();
  }
}

}  // namespace handloft::client
