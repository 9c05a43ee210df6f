#include "daemon-tracking/source/simulated/simulated_rig.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "common/base/table_palette.h"
#include "daemon-tracking/source/glove_report.h"
#include "daemon-tracking/source/simulated/camera_renderer.h"
#include "daemon-tracking/source/simulated/random.h"

namespace handloft::tracking {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

/// Streams of random numbers: cameras use camera_stream + index.
constexpr std::uint64_t glove_stream = 0x61076, camera_stream = 0xCA3E7A;
/// A jitter beyond this many standard deviations is cut: frames stay in order.
constexpr double jitter_cut = 3.0;
/// A frame must arrive before the next is exposed, so that the stream stays in order of delivery.
constexpr Duration longest_transfer = std::chrono::milliseconds(25);
/// Time of a HID report from the sensor to us: half a polling interval and the kernel.
constexpr double glove_transfer_s = 0.001;
constexpr double glove_jitter_s = 0.0002;
/// Noise of the converter, in its steps.
constexpr double analogue_noise = 1.0;
constexpr std::uint8_t battery_percent = 87;

/// The palette's cells nearer to the designer than this are in the row that he looks down at,
constexpr double near_row_y_m = -0.15;
/// so far that the row and the work are both in the picture.
constexpr double glance_y_m = -0.09;
/// Touches that follow each other so soon are one glance: time for both of its turns.
constexpr double one_glance_s = 1.5;

/// From 0 to 1, smoothly: a minimum-jerk course (Flash and Hogan 1985, eq. 4).
double eased(double u) {
  const double part = std::clamp(u, 0.0, 1.0);
  return part * part * part * (10.0 - 15.0 * part + 6.0 * part * part);
}

double cut_normal(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) {
  return std::clamp(normal(seed, stream, index), -jitter_cut, jitter_cut);
}

class CameraStream final : public SampleStream {
 public:
  CameraStream(std::shared_ptr<const SimulatedScene> scene, std::uint32_t camera)
      : scene_(std::move(scene)), camera_(camera), stream_(camera_stream + camera) {
    const SimulatedRigOptions& options = scene_->options;
    const double drift = options.drift_ppm * 1e-6 * (2 * uniform(options.seed, stream_, 1) - 1);
    period_s_ = (1 + drift) / options.frames_per_s;
    phase_s_ = options.image.exposure_s + uniform(options.seed, stream_, 0) * period_s_;
  }

  std::optional<Sample> next() override {
    const SimulatedRigOptions& options = scene_->options;
    if (!announced_) {
      announced_ = true;
      return DevicePresence{options.start, "camera/" + scene_->rig.cameras[camera_].name, true};
    }
    while (arrival_of(frame_) < skip_before_ && capture_s(frame_) <= scene_->program.duration_s()) {
      ++frame_;
      truth_told_ = false;
    }
    const TimePoint capture = capture_of(frame_);
    const double time_s = to_seconds(capture - options.start);
    if (time_s > scene_->program.duration_s()) return std::nullopt;
    if (!truth_told_) {
      truth_told_ = true;
      Truth truth = scene_->truth_at(time_s);
      truth.time = capture;
      return truth;
    }
    truth_told_ = false;
    std::optional<Sample> frame = render(capture, time_s);
    ++frame_;
    return frame;
  }

  void skip_frames_before(TimePoint time) override { skip_before_ = time; }

 private:
  double capture_s(std::uint64_t frame) const {
    const SimulatedRigOptions& options = scene_->options;
    const double jitter = options.frame_jitter_s * cut_normal(options.seed, stream_, 100 + frame);
    return phase_s_ + static_cast<double>(frame) * period_s_ + jitter;
  }

  TimePoint capture_of(std::uint64_t frame) const {
    return scene_->options.start + from_seconds(capture_s(frame));
  }

  TimePoint arrival_of(std::uint64_t frame) const {
    const SimulatedRigOptions& options = scene_->options;
    const double late_s =
        options.transfer_jitter_s * std::abs(cut_normal(options.seed, stream_ ^ glove_stream, frame));
    return capture_of(frame) + std::min(options.transfer_delay, longest_transfer) + from_seconds(late_s);
  }

  std::optional<Sample> render(TimePoint capture, double time_s) {
    const SimulatedRigOptions& options = scene_->options;
    // Drawing its background takes a while: only once a frame is wanted.
    if (!renderer_) renderer_ = std::make_unique<CameraRenderer>(scene_->rig, camera_, options.image);
    // The exposure as the mean of its thirds, each at its middle.
    const double third_s = options.image.exposure_s / 3;
    const auto exposure = [&](double delay_s) {
      const double at_s = time_s + delay_s;
      return Exposure{scene_->program.at(at_s - third_s), scene_->program.at(at_s),
                      scene_->program.at(at_s + third_s), options.head.at(at_s)};
    };
    Result<std::vector<std::uint8_t>> jpeg =
        renderer_->render(exposure, hash_bits(options.seed, stream_, frame_));
    if (!jpeg) return std::nullopt;
    CameraFrame frame;
    frame.camera = camera_;
    frame.sequence = frame_;
    frame.capture_time = capture;
    frame.arrival_time = arrival_of(frame_);
    frame.format = PixelFormat::mjpeg;
    frame.width_px = scene_->rig.cameras[camera_].intrinsics.width_px;
    frame.height_px = scene_->rig.cameras[camera_].intrinsics.height_px;
    frame.bytes = std::make_shared<const std::vector<std::uint8_t>>(std::move(*jpeg));
    return frame;
  }

  std::shared_ptr<const SimulatedScene> scene_;
  std::uint32_t camera_;
  std::uint64_t stream_;
  double period_s_ = 0, phase_s_ = 0;
  std::uint64_t frame_ = 0;
  TimePoint skip_before_ = TimePoint::min();
  bool announced_ = false, truth_told_ = false;
  std::unique_ptr<CameraRenderer> renderer_;
};

class GloveStream final : public SampleStream {
 public:
  explicit GloveStream(std::shared_ptr<const SimulatedScene> scene) : scene_(std::move(scene)) {}

  std::optional<Sample> next() override {
    const SimulatedRigOptions& options = scene_->options;
    if (!announced_) {
      announced_ = true;
      return DevicePresence{options.start, "glove", true};
    }
    const double time_s = static_cast<double>(report_ + 1) / options.glove_reports_per_s;
    if (time_s > scene_->program.duration_s()) return std::nullopt;
    const HandState hand = scene_->program.at(time_s);
    GloveReport report;
    report.sequence = static_cast<std::uint16_t>(report_);
    report.device_time_us = static_cast<std::uint32_t>(std::llround(time_s * 1e6));
    report.force = analogue(hand.pressure, 0);
    report.potentiometer = analogue(hand.potentiometer, 1);
    report.contacts = bouncing(hand.contacts);
    report.battery_percent = battery_percent;
    const auto bytes = encode_glove_report(report);
    const double late_s =
        glove_transfer_s + glove_jitter_s * std::abs(cut_normal(options.seed, glove_stream, report_));
    ++report_;
    return GloveBytes{options.start + from_seconds(time_s + late_s), {bytes.begin(), bytes.end()}};
  }

 private:
  std::uint16_t analogue(double value, std::uint64_t channel) const {
    const double noise = analogue_noise * normal(scene_->options.seed, glove_stream + 1 + channel, report_);
    return static_cast<std::uint16_t>(
        std::lround(std::clamp(value * glove_analogue_max + noise, 0.0, double{glove_analogue_max})));
  }

  /// A pad that just opened or closed shows its old state in every second report for a while.
  std::uint16_t bouncing(std::uint16_t contacts) {
    std::uint16_t seen = contacts;
    for (std::size_t bit = 0; bit < since_change_.size(); ++bit) {
      const auto mask = static_cast<std::uint16_t>(1u << bit);
      if (((contacts ^ contacts_) & mask) != 0) since_change_[bit] = 0;
      const int since = since_change_[bit];
      if (since < 2 * scene_->options.contact_bounces && since % 2 == 1)
        seen = static_cast<std::uint16_t>(seen ^ mask);
      since_change_[bit] = std::min(since + 1, 1 << 20);
    }
    contacts_ = contacts;
    return seen;
  }

  std::shared_ptr<const SimulatedScene> scene_;
  std::uint64_t report_ = 0;
  bool announced_ = false;
  std::uint16_t contacts_ = 0;
  std::array<int, 6> since_change_{1 << 20, 1 << 20, 1 << 20, 1 << 20, 1 << 20, 1 << 20};
};

std::vector<std::unique_ptr<SampleStream>> all_streams(const std::shared_ptr<const SimulatedScene>& scene) {
  std::vector<std::unique_ptr<SampleStream>> streams;
  for (std::uint32_t camera = 0; camera < scene->rig.cameras.size(); ++camera) {
    streams.push_back(simulated_camera_stream(scene, camera));
  }
  streams.push_back(simulated_glove_stream(scene));
  return streams;
}

}  // namespace

Isometry3d HeadMotion::at(double time_s) const {
  // Sums of sines of ratios that don't repeat soon.
  const double angle = 2 * std::numbers::pi * sway_hz * time_s;
  const Vector3d sway(std::sin(angle) + 0.3 * std::sin(2.7 * angle + 1.0), 0.7 * std::sin(0.73 * angle + 0.5),
                      0.4 * std::sin(1.31 * angle + 2.0));
  const Vector3d gaze(0.4 * std::sin(0.57 * angle + 0.3), 0.4 * std::sin(0.41 * angle + 1.1), 0.0);
  Isometry3d pose = Isometry3d::Identity();
  pose.translation() = rest_m + sway_m * sway;
  Vector3d look_at = look_at_m;
  for (const HeadGlance& glance : glances) {
    const double there = eased((time_s - glance.begin_s) / glance_turn_s + 1);
    const double back_again = eased((time_s - glance.end_s) / glance_turn_s);
    look_at += there * (1 - back_again) * (glance.look_at_m - look_at_m);
  }
  const Vector3d back = (pose.translation() - look_at - sway_m * gaze).normalized();
  const Vector3d right = Vector3d::UnitZ().cross(back).normalized();
  pose.linear().col(0) = right;
  pose.linear().col(1) = back.cross(right);
  pose.linear().col(2) = back;
  return pose;
}

std::vector<HeadGlance> glances_at_palette(const HandProgram& program) {
  std::vector<HeadGlance> glances;
  for (const HandEvent& event : program.events()) {
    if (event.kind != HandEvent::Kind::touch) continue;
    const auto cell = std::find_if(table_palette.begin(), table_palette.end(),
                                   [&](const PaletteCell& each) { return each.label == event.label; });
    if (cell == table_palette.end() || cell->centre_y_m > near_row_y_m) continue;
    if (!glances.empty() && event.begin_s - glances.back().end_s < one_glance_s) {
      glances.back().end_s = event.end_s;
    } else {
      glances.push_back({event.begin_s, event.end_s, Vector3d(HeadMotion{}.look_at_m.x(), glance_y_m, 0.0)});
    }
  }
  return glances;
}

Truth SimulatedScene::truth_at(double time_s) const {
  const HandState hand = program.at(time_s);
  const Isometry3d head = options.head.at(time_s);
  const Eigen::Quaterniond orientation(head.linear());
  Truth truth;
  truth.time = options.start + from_seconds(time_s);
  truth.hand_present = hand.present;
  for (int finger = 0; finger < finger_count; ++finger) {
    for (int axis = 0; axis < 3; ++axis) {
      truth.fingertips_m[finger][axis] = hand.fingertips_m[static_cast<std::size_t>(finger)][axis];
    }
  }
  for (int axis = 0; axis < 3; ++axis) truth.head_position_m[axis] = head.translation()[axis];
  truth.head_orientation_wxyz[0] = orientation.w();
  truth.head_orientation_wxyz[1] = orientation.x();
  truth.head_orientation_wxyz[2] = orientation.y();
  truth.head_orientation_wxyz[3] = orientation.z();
  truth.pressure = hand.pressure;
  return truth;
}

std::unique_ptr<SampleStream> simulated_camera_stream(std::shared_ptr<const SimulatedScene> scene,
                                                      std::uint32_t camera) {
  return std::make_unique<CameraStream>(std::move(scene), camera);
}

std::unique_ptr<SampleStream> simulated_glove_stream(std::shared_ptr<const SimulatedScene> scene) {
  return std::make_unique<GloveStream>(std::move(scene));
}

SimulatedRig::SimulatedRig(Rig rig, HandProgram program, SimulatedRigOptions options)
    : scene_(std::make_shared<SimulatedScene>(
          SimulatedScene{std::move(rig), std::move(program), std::move(options)})),
      stream_(std::make_unique<MergedStream>(all_streams(scene_))) {}

std::optional<Sample> SimulatedRig::next() {
  return stream_->next();
}

}  // namespace handloft::tracking
