#include "daemon-tracking/source/camera/v4l2_camera.h"

#include <fmt/format.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <thread>
#include <utility>

#include "daemon-tracking/source/camera/camera_monitor.h"
#include "daemon-tracking/source/camera/frame_pool.h"
#include "daemon-tracking/source/camera/v4l2_stream.h"
#include "daemon-tracking/source/camera/v4l2_timestamps.h"

namespace handloft::tracking {

namespace {

// How long poll() sleeps at most; only the once-a-second work waits for it.
constexpr int poll_ms = 100;
constexpr Duration control_interval = std::chrono::seconds(1);
// A webcam takes up to two seconds to its first frame.
constexpr Duration silence_until_lost = std::chrono::seconds(3);
// After a breakdown the camera is opened again at once, then after ever longer waits.
constexpr Duration first_back_off = std::chrono::milliseconds(100);
constexpr Duration longest_back_off = std::chrono::seconds(5);
constexpr Duration good_run = std::chrono::seconds(5);
constexpr Duration log_interval = std::chrono::seconds(10);

// Wakes a thread from poll(). Any thread may ring.
class Bell {
 public:
  Bell() : fd_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {}
  ~Bell() {
    if (fd_ >= 0) ::close(fd_);
  }
  Bell(const Bell&) = delete;
  Bell& operator=(const Bell&) = delete;
  int fd() const { return fd_; }
  void ring() const {
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t written = ::write(fd_, &one, sizeof one);
  }
  void silence() const {
    std::uint64_t count = 0;
    [[maybe_unused]] const ssize_t got = ::read(fd_, &count, sizeof count);
  }

 private:
  int fd_;
};

int to_ms(Duration duration) {
  const auto ms = std::chrono::ceil<std::chrono::milliseconds>(duration).count();
  return static_cast<int>(std::clamp<std::int64_t>(ms, 0, 60'000));
}

class Camera final : public V4l2Camera {
 public:
  Camera(std::uint32_t camera, std::string name, V4l2CameraOptions options, const Clock& clock, Logger log,
         std::shared_ptr<V4l2System> system)
      : camera_(camera),
        name_(std::move(name)),
        options_(std::move(options)),
        clock_(clock),
        log_(std::move(log)),
        system_(std::move(system)),
        keeper_(options_.settings),
        monitor_(options_.mode.rate_hz, options_.slow_rate_part) {}

  ~Camera() override { stop(); }

  std::uint32_t camera() const override { return camera_; }
  const std::string& name() const override { return name_; }
  bool finished() const override { return stopping_; }
  CameraHealth health() const override { return monitor_.health(); }
  void look_again() override {
    look_now_ = true;
    bell_.ring();
  }

  Status start(SampleSink sink) override {
    if (thread_.joinable() || stopping_)
      return make_error(ErrorCode::failed_precondition, "already started", name_);
    sink_ = std::move(sink);
    if (options_.hotplug != nullptr) {
      plugs_ = options_.hotplug->subscribe("video4linux",
                                           [this](PlugChange, const PluggedDevice&) { look_again(); });
    }
    thread_ = std::thread([this] { run(); });
    return {};
  }

  void stop() override {
    stopping_ = true;
    bell_.ring();
    plugs_.reset();
    if (thread_.joinable()) thread_.join();
  }

 private:
  void run();
  Status open();
  Status stream();
  Status turn(TimePoint now);
  void hand_on(CapturedFrame frame);
  void look_at_controls(TimePoint now);
  void lose(const Error& why);
  void tell(bool present);
  void wait(Duration longest);
  void speak(const std::string& problem);

  const std::uint32_t camera_;
  const std::string name_;
  const V4l2CameraOptions options_;
  const Clock& clock_;
  const Logger log_;
  const std::shared_ptr<V4l2System> system_;
  SampleSink sink_;
  Bell bell_;
  std::atomic<bool> stopping_ = false;
  std::atomic<bool> look_now_ = false;

  // The thread's own.
  FramePool pool_;
  ControlKeeper keeper_;
  std::unique_ptr<V4l2Stream> stream_;
  std::optional<FrameStamper> stamper_;
  std::optional<bool> told_present_;
  Duration back_off_{};
  TimePoint opened_;
  TimePoint last_sign_;  ///< Opened, or the last buffer filled.
  TimePoint next_look_;
  Duration exposure_{};
  std::uint64_t next_sequence_ = 0;
  std::uint32_t last_sequence_ = 0;
  bool first_frame_ = true;
  std::string spoken_;
  RateLimit speech_{log_interval};

  CameraMonitor monitor_;
  std::unique_ptr<HotplugMonitor::Subscription> plugs_;
  std::thread thread_;
};

void Camera::tell(bool present) {
  if (told_present_ == present) return;
  told_present_ = present;
  sink_(DevicePresence{clock_.now(), name_, present});
}

void Camera::wait(Duration longest) {
  // Real time, also where the clock is a test's: it is a pause, not a measurement.
  std::array<pollfd, 1> bell{{{bell_.fd(), POLLIN, 0}}};
  if (!stopping_ && !look_now_) system_->poll(bell, to_ms(longest));
  bell_.silence();
}

// Once when a problem appears or changes, at most every ten seconds.
void Camera::speak(const std::string& problem) {
  if (problem == spoken_) return;
  if (problem.empty()) {
    log_.info("{}: all is well again", name_);
    spoken_.clear();
    return;
  }
  if (!speech_.allow(clock_.now())) return;
  spoken_ = problem;
  log_.warning("{}: {}", name_, problem);
}

Status Camera::open() {
  const Result<NodeMatch> match = match_camera(system_->nodes(), options_.selector, options_.mismatch);
  if (!match) return match.error();
  Status last = make_error(ErrorCode::not_found, "found no node of the camera", name_);
  for (const V4l2Node& node : match->nodes) {
    Result<std::unique_ptr<V4l2Stream>> stream =
        V4l2Stream::open(system_, node.node, options_.mode, clock_, pool_);
    if (!stream) {
      // A camera's metadata node says no more than that it is none.
      if (stream.error().code != ErrorCode::unsupported || match->nodes.size() == 1) last = stream.error();
      continue;
    }
    stream_ = std::move(*stream);
    const TimePoint now = clock_.now();
    opened_ = last_sign_ = now;
    next_look_ = now + control_interval;
    first_frame_ = true;
    StampOptions stamps;
    if (stream_->mode().rate_hz > 0) stamps.frame_interval = from_seconds(1.0 / stream_->mode().rate_hz);
    stamps.readout = options_.readout;
    stamps.offset = options_.time_offset;
    stamper_.emplace(stamps);
    const ControlReport controls = keeper_.apply(*system_, stream_->fd());
    exposure_ = controls.exposure_time;
    monitor_.opened(now, node, stream_->model(), stream_->mode(), stream_->compromise(), match->note);
    monitor_.controls(controls);
    log_.info("{}: {} ({}), {}, runs at {}", name_, stream_->model(), node.node, identity_of(node),
              to_string(stream_->mode()));
    return {};
  }
  return last;
}

void Camera::lose(const Error& why) {
  if (stream_) monitor_.lost();
  stream_.reset();
  stamper_.reset();
  monitor_.absent(why.message);
  tell(false);
  speak(why.message);
  if (why.code == ErrorCode::not_found) {
    back_off_ = Duration{};
    return;
  }
  if (clock_.now() - opened_ > good_run) back_off_ = Duration{};
  back_off_ = std::clamp(2 * back_off_, first_back_off, longest_back_off);
}

void Camera::hand_on(CapturedFrame captured) {
  const FrameStamp stamp = stamper_->stamp(captured.stamp, captured.dequeued, exposure_);
  // The driver counts from 0 again after each plug; ours goes on, by the frames that were lost between.
  const std::uint32_t step = captured.sequence - last_sequence_;
  constexpr std::uint32_t believable_step = 1u << 16;
  if (!first_frame_) next_sequence_ += step >= 1 && step < believable_step ? step - 1 : 0;
  first_frame_ = false;
  last_sequence_ = captured.sequence;

  CameraFrame frame;
  frame.camera = camera_;
  frame.sequence = next_sequence_++;
  frame.capture_time = stamp.capture;
  frame.arrival_time = captured.dequeued;
  frame.format = stream_->mode().format;
  frame.width_px = stream_->mode().width_px;
  frame.height_px = stream_->mode().height_px;
  frame.bytes = std::move(captured.bytes);
  monitor_.frame(frame.arrival_time, frame.capture_time, stamp.estimated, captured.stamp.point);
  sink_(std::move(frame));
}

void Camera::look_at_controls(TimePoint now) {
  if (now < next_look_) return;
  next_look_ = now + control_interval;
  const ControlReport controls = keeper_.check(*system_, stream_->fd());
  exposure_ = controls.exposure_time;
  monitor_.controls(controls);
  for (const std::string& drift : controls.drifted) {
    if (const auto kept_back = speech_.allow(now)) log_.warning("{}: {} ({} more)", name_, drift, *kept_back);
  }
}

Status Camera::turn(TimePoint now) {
  Result<std::optional<CapturedFrame>> frame = stream_->newest();
  if (!frame) return frame.error();
  const StreamCounters& counters = stream_->counters();
  if (monitor_.counted(counters)) last_sign_ = now;
  if (*frame) hand_on(std::move(**frame));
  return {};
}

Status Camera::stream() {
  std::array<pollfd, 2> what{{{stream_->fd(), POLLIN, 0}, {bell_.fd(), POLLIN, 0}}};
  while (!stopping_) {
    what[0].revents = what[1].revents = 0;
    const int ready = system_->poll(what, poll_ms);
    if (ready < 0) return make_error(ErrorCode::io, "waiting for frames failed", name_);
    if ((what[1].revents & POLLIN) != 0) {
      bell_.silence();
      look_now_ = false;
      if (stopping_) break;
      // Word of a plug may be late, and mean the camera that had this number before ours.
      if (!stream_->alive()) return make_error(ErrorCode::not_found, "it was unplugged", name_);
    }
    const TimePoint now = clock_.now();
    if (what[0].revents != 0) {
      const std::uint64_t before = stream_->counters().filled;
      if (const Status turned = turn(now); !turned) return turned;
      // An error that DQBUF doesn't explain would come back for ever.
      const bool nothing_came = stream_->counters().filled == before;
      if ((what[0].revents & (POLLERR | POLLHUP | POLLNVAL)) != 0 && nothing_came)
        return make_error(ErrorCode::not_found, "it was unplugged or its driver gave up", name_);
    }
    if (now - last_sign_ > silence_until_lost)
      return make_error(
          ErrorCode::io,
          fmt::format("no frame for {:.0f} s: check its cable, hub and power", to_seconds(now - last_sign_)),
          name_);
    look_at_controls(now);
    if (monitor_.second_passed(now)) speak(monitor_.health().problem);
  }
  return {};
}

void Camera::run() {
  while (!stopping_) {
    look_now_ = false;
    if (const Status opened = open(); !opened) {
      lose(opened.error());
      wait(std::max(back_off_, options_.retry_interval));
      continue;
    }
    tell(true);
    if (const Status ended = stream(); !ended) {
      lose(ended.error());
      if (!stopping_) wait(std::max(back_off_, first_back_off));
    }
  }
  stream_.reset();
}

}  // namespace

std::unique_ptr<V4l2Camera> make_v4l2_camera(std::uint32_t camera, std::string name,
                                             V4l2CameraOptions options, const Clock& clock, Logger log) {
  return make_v4l2_camera(camera, std::move(name), std::move(options), clock, std::move(log),
                          make_v4l2_system());
}

std::unique_ptr<V4l2Camera> make_v4l2_camera(std::uint32_t camera, std::string name,
                                             V4l2CameraOptions options, const Clock& clock, Logger log,
                                             std::shared_ptr<V4l2System> system) {
  return std::make_unique<Camera>(camera, std::move(name), std::move(options), clock, std::move(log),
                                  std::move(system));
}

}  // namespace handloft::tracking
