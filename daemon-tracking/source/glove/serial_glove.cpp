#include "daemon-tracking/source/glove/serial_glove.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <condition_variable>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "daemon-tracking/source/glove/serial_glove_line.h"

namespace handloft::tracking {
namespace {

constexpr const char* glove_name = "glove";
constexpr std::string_view serial_prefix = "serial=";
constexpr int read_wait_ms = 20;
constexpr Duration first_back_off = std::chrono::milliseconds(100);
constexpr Duration last_back_off = std::chrono::seconds(2);

TimePoint waiting_now() {
  return SystemClock().now();
}

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor& operator=(Descriptor&&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  int get() const { return fd_; }

 private:
  int fd_;
};

Result<Descriptor> open_line(const std::string& path) {
  Descriptor line(::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (line.get() < 0) {
    const int reason = errno;
    if (reason == EACCES || reason == EPERM) {
      return make_error(
          ErrorCode::permission_denied,
          fmt::format("{} may not be opened by this user: add the user to the group 'dialout' or "
                      "install Handloft's udev rules, then log in anew",
                      path),
          path);
    }
    return make_error(reason == ENOENT ? ErrorCode::not_found : ErrorCode::io,
                      fmt::format("{} does not open: {}", path, std::strerror(reason)), path);
  }
  termios settings{};
  if (::tcgetattr(line.get(), &settings) != 0) {
    return make_error(ErrorCode::unsupported, fmt::format("{} is no serial line", path), path);
  }
  ::cfmakeraw(&settings);
  settings.c_cflag |= CLOCAL | CREAD;
  ::cfsetispeed(&settings, B115200);
  ::cfsetospeed(&settings, B115200);
  if (::tcsetattr(line.get(), TCSANOW, &settings) != 0) {
    return make_error(ErrorCode::io, fmt::format("{} takes no 115200 baud: {}", path, std::strerror(errno)),
                      path);
  }
  // Nobody else shall eat its bytes. Some pseudo terminals know no such thing.
  (void)::ioctl(line.get(), TIOCEXCL);
  (void)::tcflush(line.get(), TCIFLUSH);
  return line;
}

class SerialGlove final : public GloveSource {
 public:
  SerialGlove(SerialGloveOptions options, HotplugMonitor& hotplug, const Clock& clock, Logger log)
      : options_(std::move(options)),
        hotplug_(hotplug),
        clock_(clock),
        log_(std::move(log)),
        name_(glove_name) {}
  ~SerialGlove() override { SerialGlove::stop(); }

  const std::string& name() const override { return name_; }
  bool finished() const override { return false; }
  DeviceStatus status() const override {
    const std::lock_guard lock(mutex_);
    return status_;
  }

  Status start(SampleSink sink) override {
    if (thread_.joinable()) return make_error(ErrorCode::failed_precondition, "is reading already", name_);
    if (options_.line.empty()) {
      return make_error(ErrorCode::invalid_argument,
                        "found none, expected a serial line such as /dev/ttyUSB0", "glove.line");
    }
    sink_ = std::move(sink);
    {
      const std::lock_guard lock(mutex_);
      stopping_ = false;
      status_.problem = fmt::format("not plugged in: plug the glove of {} in", options_.line);
    }
    subscription_ = hotplug_.subscribe(
        "tty", [this](PlugChange change, const PluggedDevice& device) { on_plug(change, device); });
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
  bool is_meant(const PluggedDevice& device) const {
    const std::string_view line = options_.line;
    if (line.starts_with(serial_prefix)) return device.serial == line.substr(serial_prefix.size());
    if (device.devnode == line) return true;
    std::error_code error;  // A link by id.
    const auto target = std::filesystem::weakly_canonical(line, error);
    return !error && target == device.devnode;
  }

  void on_plug(PlugChange change, const PluggedDevice& device) {
    const std::lock_guard lock(mutex_);
    if (change == PlugChange::removed) {
      if (plugged_ && plugged_->devnode == device.devnode) plugged_.reset();
    } else if (!plugged_ && is_meant(device)) {
      plugged_ = device;
      not_before_ = {};
      back_off_ = {};
    }
    changed_.notify_all();
  }

  void run() {
    while (true) {
      std::string path;
      {
        std::unique_lock lock(mutex_);
        while (!stopping_ && (!plugged_ || not_before_ > waiting_now())) {
          const Duration wait = plugged_ ? not_before_ - waiting_now() : Duration(std::chrono::hours(1));
          changed_.wait_for(lock, std::max(wait, Duration(std::chrono::milliseconds(1))));
        }
        if (stopping_) return;
        path = plugged_->devnode;
        status_.identity = describe(*plugged_);
      }
      auto line = open_line(path);
      if (!line) {
        fail(line.error().message);
        continue;
      }
      read_on(line->get(), path);
    }
  }

  void read_on(int line, const std::string& path) {
    log_.info("glove on {}", path);
    LineCutter cutter;
    cutter.skip_to_next();
    std::array<std::uint8_t, 512> bytes{};
    TimePoint last = waiting_now();
    bool present = false;
    std::string problem;
    while (problem.empty()) {
      pollfd waited{line, POLLIN, 0};
      const int ready = ::poll(&waited, 1, read_wait_ms);
      if (ready > 0) {
        const auto size = ::read(line, bytes.data(), bytes.size());
        if (size > 0) {
          const TimePoint arrival = clock_.now();
          cutter.feed(std::span(bytes).first(static_cast<std::size_t>(size)),
                      [&](std::span<const std::uint8_t> text) {
                        const bool good = take(text, arrival, present);
                        if (good) last = waiting_now();
                      });
        } else if (size == 0 || (errno != EAGAIN && errno != EINTR)) {
          problem = size == 0 ? "the serial line hung up" : std::strerror(errno);
        }
      }
      if (waiting_now() - last > options_.silent_after) {
        problem =
            "no glove speaks there: is it switched on, and does its firmware use alpha encoding at 115200 "
            "baud?";
      }
      const std::lock_guard lock(mutex_);
      if (stopping_) break;
      if (!plugged_) problem = "was unplugged: plug it in again";
    }
    const bool was_present = present;
    {
      const std::lock_guard lock(mutex_);
      status_.present = false;
      if (was_present) ++status_.times_lost;
    }
    if (was_present) sink_(DevicePresence{clock_.now(), name_, false});
    if (!problem.empty()) fail(fmt::format("{}: {}", path, problem));
  }

  // It is there once it speaks.
  bool take(std::span<const std::uint8_t> text, TimePoint arrival, bool& present) {
    const bool good = parse_serial_glove_line(text).ok();
    {
      const std::lock_guard lock(mutex_);
      ++status_.samples;
      if (!good) ++status_.refused;
      status_.last_sample = arrival;
      if (good) {
        status_.present = true;
        status_.problem.clear();
        back_off_ = {};
      }
    }
    if (good && !present) sink_(DevicePresence{arrival, name_, true});
    present = present || good;
    if (present) {
      sink_(DeviceBytes{arrival, DeviceData::serial_glove_line, {text.begin(), text.end()}});
    }
    return good;
  }

  void fail(std::string problem) {
    if (limit_.allow(waiting_now())) log_.warning("glove: {}", problem);
    const std::lock_guard lock(mutex_);
    back_off_ = std::clamp(back_off_ * 2, first_back_off, last_back_off);
    not_before_ = waiting_now() + back_off_;
    status_.problem = std::move(problem);
  }

  SerialGloveOptions options_;
  HotplugMonitor& hotplug_;
  const Clock& clock_;
  Logger log_;
  RateLimit limit_{std::chrono::seconds(10)};
  std::string name_;
  SampleSink sink_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<PluggedDevice> plugged_;
  TimePoint not_before_;
  Duration back_off_{};
  DeviceStatus status_;
  bool stopping_ = false;
  std::unique_ptr<HotplugMonitor::Subscription> subscription_;
  std::thread thread_;
};

}  // namespace

std::unique_ptr<GloveSource> make_serial_glove(const SerialGloveOptions& options, HotplugMonitor& hotplug,
                                               const Clock& clock, Logger log) {
  return std::make_unique<SerialGlove>(options, hotplug, clock, std::move(log));
}

}  // namespace handloft::tracking
