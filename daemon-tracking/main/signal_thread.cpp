#include "daemon-tracking/main/signal_thread.h"

#include <fmt/format.h>
#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstring>

namespace handloft::tracking {

SignalThread::SignalThread(SessionControl& control) : control_(control) {
  sigset_t taken;
  sigemptyset(&taken);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&taken, signal);
  pthread_sigmask(SIG_BLOCK, &taken, nullptr);
  signals_.reset(signalfd(-1, &taken, SFD_CLOEXEC | SFD_NONBLOCK));
  ending_.reset(eventfd(0, EFD_CLOEXEC));
  if (!signals_.valid() || !ending_.valid()) {
    status_ = make_error(ErrorCode::io, fmt::format("signalfd: {}", std::strerror(errno)), "signals");
    return;
  }
  thread_ = std::thread([this] { run(); });
}

SignalThread::~SignalThread() {
  if (!thread_.joinable()) return;
  const std::uint64_t one = 1;
  (void)!write(ending_.get(), &one, sizeof(one));
  thread_.join();
}

void SignalThread::run() {
  std::array<pollfd, 2> waited{pollfd{signals_.get(), POLLIN, 0}, pollfd{ending_.get(), POLLIN, 0}};
  for (;;) {
    if (poll(waited.data(), waited.size(), -1) < 0 && errno != EINTR) return;
    if ((waited[1].revents & POLLIN) != 0) return;
    signalfd_siginfo info{};
    while (read(signals_.get(), &info, sizeof(info)) == static_cast<ssize_t>(sizeof(info))) {
      if (info.ssi_signo == SIGHUP) {
        control_.reload();
      } else {
        control_.stop();
      }
    }
  }
}

}  // namespace handloft::tracking
