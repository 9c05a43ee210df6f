#pragma once
// What a program of ours and systemd tell each other (sd_listen_fds(3), sd_notify(3)): the sockets that
// systemd listens on for us, that we are ready, reloading or ending, and that we are alive. Without systemd
// all of it does nothing.

#include <atomic>
#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "common/net/endpoint.h"

namespace handloft::net {

class ServiceManager {
 public:
  /// Reads and clears the environment that systemd set. `clock` must outlive the object.
  explicit ServiceManager(const Clock& clock);

  /// The sockets of our unit; none without socket activation. Once. Errors: those of adopt_listener.
  Result<std::vector<Listener>> take_listeners();
  /// The same of a program that has one. Errors: also invalid_argument for several.
  Result<std::optional<Listener>> take_listener();

  void ready(std::string_view status);
  void status(std::string_view words);
  void reloading(std::string_view status);
  void stopping();
  /// To be called by whoever would hang with the rest; tells systemd often enough and no more. Any thread.
  void alive();
  /// How often alive() is to be called at least; nullopt: nobody watches.
  std::optional<std::chrono::milliseconds> watchdog_interval() const { return interval_; }

 private:
  const Clock& clock_;
  int passed_sockets_ = 0;
  std::optional<std::chrono::milliseconds> interval_;
  std::atomic<std::int64_t> told_ns_{0};
};

}  // namespace handloft::net
