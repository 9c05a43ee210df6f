#include "daemon-tracking/source/pen/evdev_pen.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <libevdev/libevdev.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <condition_variable>
#include <cstring>
#include <ctime>
#include <map>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "daemon-tracking/source/pen/pen_events.h"

namespace handloft::tracking {
namespace {

constexpr int read_wait_ms = 20;
constexpr Duration first_back_off = std::chrono::milliseconds(50);
constexpr Duration last_back_off = std::chrono::seconds(1);
constexpr const char* unplugged = "was unplugged: plug the pen tablet in";
// What a pen's state consists of: told when the tablet is opened, by whatever it is then.
constexpr std::array<unsigned, 5> axes{ABS_X, ABS_Y, ABS_PRESSURE, ABS_TILT_X, ABS_TILT_Y};
constexpr std::array<unsigned, 6> keys{BTN_TOOL_PEN, BTN_TOOL_RUBBER, BTN_TOUCH,
                                       BTN_STYLUS,   BTN_STYLUS2,     BTN_STYLUS3};

TimePoint waiting_now() {
  return SystemClock().now();
}

struct EvdevDelete {
  void operator()(libevdev* it) const {
    const int fd = libevdev_get_fd(it);
    libevdev_free(it);
    if (fd >= 0) ::close(fd);
  }
};
using EvdevPtr = std::unique_ptr<libevdev, EvdevDelete>;

PenAxis read_axis(const libevdev* device, unsigned code) {
  const input_absinfo* info = libevdev_get_abs_info(device, code);
  if (info == nullptr) return {};
  return {true, info->minimum, info->maximum, std::max(info->resolution, 0)};
}

Result<EvdevPtr> open_tablet(const std::string& path, PenGrab grab) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) {
    const int reason = errno;
    if (reason == EACCES || reason == EPERM) {
      return make_error(ErrorCode::permission_denied,
                        fmt::format("{} may not be opened by this user: install Handloft's udev rules "
                                    "(deploy/README.md), then plug it out and in again",
                                    path),
                        path);
    }
    return make_error(ErrorCode::io, fmt::format("{} does not open: {}", path, std::strerror(reason)), path);
  }
  libevdev* raw = nullptr;
  if (const int code = libevdev_new_from_fd(fd, &raw); code < 0) {
    ::close(fd);
    return make_error(ErrorCode::io, fmt::format("{} gives no input events: {}", path, std::strerror(-code)),
                      path);
  }
  EvdevPtr device(raw);
  if (!libevdev_has_event_code(raw, EV_ABS, ABS_X) || !libevdev_has_event_code(raw, EV_ABS, ABS_Y) ||
      !libevdev_has_event_code(raw, EV_KEY, BTN_TOOL_PEN)) {
    return make_error(ErrorCode::unsupported,
                      fmt::format("{} ({}) is no tablet with a pen", path, libevdev_get_name(raw)), path);
  }
  if (const int code = libevdev_set_clock_id(raw, CLOCK_MONOTONIC); code < 0) {
    return make_error(
        ErrorCode::unsupported,
        fmt::format("{} does not stamp its events by CLOCK_MONOTONIC: {}", path, std::strerror(-code)), path);
  }
  if (grab == PenGrab::exclusive) {
    if (const int code = libevdev_grab(raw, LIBEVDEV_GRAB); code < 0) {
      return make_error(ErrorCode::io,
                        fmt::format("{} is held by another program ({}): end it, or let the pen be shared",
                                    path, std::strerror(-code)),
                        path);
    }
  }
  return device;
}

class EvdevPen final : public PenSource {
 public:
  EvdevPen(EvdevPenOptions options, HotplugMonitor& hotplug, const Clock& clock, Logger log)
      : options_(std::move(options)),
        hotplug_(hotplug),
        clock_(clock),
        log_(std::move(log)),
        name_(pen_device) {}
  ~EvdevPen() override { EvdevPen::stop(); }

  const std::string& name() const override { return name_; }
  bool finished() const override { return false; }
  DeviceStatus status() const override {
    const std::lock_guard lock(mutex_);
    return status_;
  }

  Status start(SampleSink sink) override {
    if (thread_.joinable()) return make_error(ErrorCode::failed_precondition, "is reading already", name_);
    sink_ = std::move(sink);
    {
      const std::lock_guard lock(mutex_);
      stopping_ = false;
      status_.problem = "not plugged in: plug a pen tablet in";
    }
    subscription_ = hotplug_.subscribe(
        "input", [this](PlugChange change, const PluggedDevice& device) { on_plug(change, device); });
    thread_ = std::thread([this] { run(); });
    return {};
  }

  void stop() override {
    subscription_.reset();
    {
      const std::lock_guard lock(mutex_);
      stopping_ = true;
    }
    changed_.notify_all();
    if (thread_.joinable()) thread_.join();
  }

 private:
  struct Node {
    PluggedDevice device;
    TimePoint not_before;
    Duration back_off{};
    bool foreign = false;
  };

  void on_plug(PlugChange change, const PluggedDevice& device) {
    const std::lock_guard lock(mutex_);
    if (change == PlugChange::removed) {
      // A read may have failed before udev's word came; then this is the reason.
      if (nodes_.erase(device.devnode) > 0 && !status_.present) status_.problem = unplugged;
    } else if (device.tablet && device.devnode.find("/event") != std::string::npos &&
               (options_.serial.empty() || device.serial == options_.serial)) {
      nodes_.insert_or_assign(device.devnode, Node{device, {}, {}, false});
    }
    changed_.notify_all();
  }

  // With the mutex held.
  std::map<std::string, Node>::iterator choose(Duration& wait) {
    const TimePoint now = waiting_now();
    for (auto node = nodes_.begin(); node != nodes_.end(); ++node) {
      if (node->second.foreign) continue;
      if (node->second.not_before <= now) return node;
      wait = std::min(wait, node->second.not_before - now);
    }
    return nodes_.end();
  }

  void run() {
    while (true) {
      std::string path;
      {
        std::unique_lock lock(mutex_);
        while (!stopping_) {
          Duration wait = std::chrono::hours(1);
          const auto node = choose(wait);
          if (node != nodes_.end()) {
            path = node->first;
            status_.identity = describe(node->second.device);
            break;
          }
          changed_.wait_for(lock, wait);
        }
        if (stopping_) return;
      }
      auto device = open_tablet(path, options_.grab);
      if (!device) {
        fail(path, device.error());
        continue;
      }
      use(**device, path);
    }
  }

  void use(libevdev& device, const std::string& path) {
    PenFacts facts;
    const std::array<PenAxis*, axes.size()> to{&facts.x, &facts.y, &facts.pressure, &facts.tilt_x,
                                               &facts.tilt_y};
    for (std::size_t i = 0; i < axes.size(); ++i) *to[i] = read_axis(&device, axes[i]);
    const std::vector<std::uint8_t> fact_bytes = encode_pen_facts(facts);
    if (auto good = parse_pen_facts(fact_bytes); !good) {
      return fail(path,
                  make_error(ErrorCode::unsupported,
                             fmt::format("{} has absurd axes: {}", path, good.error().describe()), path));
    }
    const TimePoint now = clock_.now();
    log_.info("pen is here: {}", status().identity);
    {
      const std::lock_guard lock(mutex_);
      status_.present = true;
      status_.problem.clear();
      if (const auto node = nodes_.find(path); node != nodes_.end()) node->second.back_off = {};
    }
    sink_(DevicePresence{now, name_, true});
    sink_(DeviceBytes{now, DeviceData::pen_facts, fact_bytes});
    tell_state(device, now);
    const Status end = read_on(device, path);
    {
      const std::lock_guard lock(mutex_);
      status_.present = false;
      if (!stopping_) ++status_.times_lost;
    }
    sink_(DevicePresence{clock_.now(), name_, false});
    if (!end) fail(path, end.error());
  }

  void tell_state(const libevdev& device, TimePoint now) {
    events_.clear();
    const auto add = [&](unsigned type, unsigned code) {
      int value = 0;
      if (libevdev_fetch_event_value(&device, type, code, &value) != 0)
        events_.push_back({now, static_cast<std::uint16_t>(type), static_cast<std::uint16_t>(code), value});
    };
    for (const unsigned code : axes) add(EV_ABS, code);
    for (const unsigned code : keys) add(EV_KEY, code);
    events_.push_back({now, EV_SYN, SYN_REPORT, 0});
    flush(now);
  }

  // Success: it was unplugged, or the end has come.
  Status read_on(libevdev& device, const std::string& path) {
    while (true) {
      pollfd waited{libevdev_get_fd(&device), POLLIN, 0};
      const int ready = ::poll(&waited, 1, read_wait_ms);
      if (ready > 0) {
        if (Status status = drain(device); !status) return status;
        if ((waited.revents & (POLLERR | POLLHUP | POLLNVAL)) != 0 && (waited.revents & POLLIN) == 0)
          return make_error(ErrorCode::io, "the tablet broke off: it hung up", path);
      }
      const std::lock_guard lock(mutex_);
      if (stopping_) return {};
      if (!nodes_.contains(path)) {
        status_.problem = unplugged;
        return {};
      }
    }
  }

  // Hands on every frame of events that is there.
  Status drain(libevdev& device) {
    unsigned flag = LIBEVDEV_READ_FLAG_NORMAL;
    while (true) {
      input_event event{};
      const int code = libevdev_next_event(&device, flag, &event);
      if (code == -EAGAIN) {
        if (flag == LIBEVDEV_READ_FLAG_NORMAL) return {};
        flag = LIBEVDEV_READ_FLAG_NORMAL;  // All differences are told.
        continue;
      }
      if (code < 0) {
        return make_error(ErrorCode::io, fmt::format("the tablet broke off: {}", std::strerror(-code)),
                          name_);
      }
      if (code == LIBEVDEV_READ_STATUS_SYNC && flag == LIBEVDEV_READ_FLAG_NORMAL) {
        // The kernel's buffer overran. libevdev reads what is and tells the differences in sync mode.
        flag = LIBEVDEV_READ_FLAG_SYNC;
        const std::lock_guard lock(mutex_);
        ++status_.lost;
      }
      const TimePoint time = from_ns(std::int64_t{event.input_event_sec} * 1'000'000'000 +
                                     std::int64_t{event.input_event_usec} * 1'000);
      events_.push_back({time, event.type, event.code, event.value});
      const bool complete = event.type == EV_SYN && event.code == SYN_REPORT;
      if (complete || events_.size() == max_pen_events) flush(clock_.now());
    }
  }

  void flush(TimePoint arrival) {
    {
      const std::lock_guard lock(mutex_);
      ++status_.samples;
      status_.last_sample = arrival;
    }
    sink_(DeviceBytes{arrival, DeviceData::pen_events, encode_pen_events(events_)});
    events_.clear();
  }

  void fail(const std::string& path, const Error& error) {
    if (limit_.allow(waiting_now())) log_.warning("pen: {}", error.message);
    const std::lock_guard lock(mutex_);
    status_.problem = error.message;
    const auto node = nodes_.find(path);
    if (node == nodes_.end()) return;
    if (error.code == ErrorCode::unsupported) node->second.foreign = true;
    node->second.back_off = error.code == ErrorCode::permission_denied
                                ? last_back_off
                                : std::clamp(node->second.back_off * 2, first_back_off, last_back_off);
    node->second.not_before = waiting_now() + node->second.back_off;
  }

  EvdevPenOptions options_;
  HotplugMonitor& hotplug_;
  const Clock& clock_;
  Logger log_;
  RateLimit limit_{std::chrono::seconds(10)};
  std::string name_;
  SampleSink sink_;
  std::vector<PenEvent> events_;  // Of the frame that is not complete yet; the thread's own.
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::string, Node> nodes_;
  DeviceStatus status_;
  bool stopping_ = false;
  std::unique_ptr<HotplugMonitor::Subscription> subscription_;
  std::thread thread_;
};

}  // namespace

std::unique_ptr<PenSource> make_evdev_pen(const EvdevPenOptions& options, HotplugMonitor& hotplug,
                                          const Clock& clock, Logger log) {
  return std::make_unique<EvdevPen>(options, hotplug, clock, std::move(log));
}

}  // namespace handloft::tracking
