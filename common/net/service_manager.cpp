#include "common/net/service_manager.h"

#include <fmt/format.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <cstdint>
#include <utility>

namespace handloft::net {

namespace {

constexpr int forget_environment = 1;  // Programs that we start would take it for theirs.
constexpr std::uint64_t beats_per_timeout = 3;
constexpr std::int64_t ns_per_us = 1000;

void notify(const std::string& state) {
  (void)sd_notify(0, state.c_str());
}

}  // namespace

ServiceManager::ServiceManager(const Clock& clock) : clock_(clock) {
  passed_sockets_ = sd_listen_fds(forget_environment);
  std::uint64_t timeout_us = 0;
  if (sd_watchdog_enabled(0, &timeout_us) > 0 && timeout_us > 0) {
    interval_ = std::chrono::duration_cast<std::chrono::milliseconds>(
        std::chrono::microseconds(timeout_us / beats_per_timeout));
  }
}

Result<std::vector<Listener>> ServiceManager::take_listeners() {
  const int count = std::exchange(passed_sockets_, 0);
  std::vector<Listener> listeners;
  for (int i = 0; i < count; ++i) {
    Result<Listener> listener = adopt_listener(FileDescriptor(SD_LISTEN_FDS_START + i));
    if (!listener) return listener.error();
    listeners.push_back(std::move(*listener));
  }
  return listeners;
}

Result<std::optional<Listener>> ServiceManager::take_listener() {
  if (passed_sockets_ > 1) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found {} sockets from systemd, expected one ListenStream=", passed_sockets_),
        "LISTEN_FDS");
  }
  Result<std::vector<Listener>> listeners = take_listeners();
  if (!listeners) return listeners.error();
  if (listeners->empty()) return std::optional<Listener>();
  return std::optional<Listener>(std::move(listeners->front()));
}

void ServiceManager::ready(std::string_view status) {
  notify(fmt::format("READY=1\nSTATUS={}", status));
}

void ServiceManager::status(std::string_view words) {
  notify(fmt::format("STATUS={}", words));
}

void ServiceManager::reloading(std::string_view status) {
  notify(fmt::format("RELOADING=1\nMONOTONIC_USEC={}\nSTATUS={}", to_ns(clock_.now()) / ns_per_us, status));
}

void ServiceManager::stopping() {
  notify("STOPPING=1\nSTATUS=Ending");
}

void ServiceManager::alive() {
  if (!interval_) return;
  const std::int64_t now = to_ns(clock_.now());
  std::int64_t told = told_ns_.load();
  if (told != 0 && now - told < std::chrono::nanoseconds(*interval_).count()) return;
  if (told_ns_.compare_exchange_strong(told, now)) notify("WATCHDOG=1");
}

}  // namespace handloft::net
