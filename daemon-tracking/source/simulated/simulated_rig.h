#pragma once
// The simulated rig: every camera renders what it sees of the scene in its own, free-running time, the glove
// sends its reports, the truth is told beside them. A deterministic function of its options: the same seed
// gives the same bytes.

#include <cstdint>
#include <memory>
#include <vector>

#include "daemon-tracking/source/rig.h"
#include "daemon-tracking/source/sample_stream.h"
#include "daemon-tracking/source/simulated/hand_program.h"
#include "daemon-tracking/source/simulated/image_options.h"

namespace handloft::tracking {

/// While the head looks somewhere else.
struct HeadGlance {
  double begin_s = 0, end_s = 0;
  Eigen::Vector3d look_at_m = Eigen::Vector3d::Zero();
};

/// The head sways gently while it looks at the table's centre, and elsewhere during its glances.
struct HeadMotion {
  Eigen::Vector3d rest_m{0.0, -0.36, 0.46};
  Eigen::Vector3d look_at_m{0.05, 0.0, 0.03};
  double sway_m = 0.015;  ///< Amplitude of the slowest component.
  double sway_hz = 0.17;
  std::vector<HeadGlance> glances;  ///< None overlaps another.
  double glance_turn_s = 0.5;       ///< To turn there before one begins, and back after it: some 20 deg/s.

  /// world_from_head at a time; axes as in Rig::head_tags.
  Eigen::Isometry3d at(double time_s) const;
};

/// Whoever touches the palette's row between the work and himself looks down at it: it is 21 degrees below
/// his gaze, where a picture of what he sees ends. One glance for touches that follow each other.
std::vector<HeadGlance> glances_at_palette(const HandProgram& program);

struct SimulatedRigOptions {
  std::uint64_t seed = 1;
  TimePoint start{};  ///< When the program begins; frames follow at once.
  double frames_per_s = 30.0;
  double frame_jitter_s = 0.0004;  ///< RMS of a frame's time about the camera's own beat: USB webcams.
  double drift_ppm = 80.0;         ///< Largest deviation of a camera's beat from nominal.
  Duration transfer_delay =
      std::chrono::milliseconds(4);  ///< From the middle of the exposure to arrival; <= 25 ms.
  double transfer_jitter_s = 0.0003;
  double glove_reports_per_s = 250.0;
  int contact_bounces = 1;  ///< A closing or opening contact flips this often, report by report.
  HeadMotion head;
  ImageOptions image;
};

/// The scene as all devices see it. Shared, immutable.
struct SimulatedScene {
  Rig rig;
  HandProgram program;
  SimulatedRigOptions options;

  Truth truth_at(double time_s) const;
};

/// Frames of one camera and the Truth at each of their capture times, begun by its DevicePresence.
std::unique_ptr<SampleStream> simulated_camera_stream(std::shared_ptr<const SimulatedScene> scene,
                                                      std::uint32_t camera);

/// The glove's reports, begun by its DevicePresence.
std::unique_ptr<SampleStream> simulated_glove_stream(std::shared_ptr<const SimulatedScene> scene);

/// All of it in order of arrival, as fast as it is asked for.
class SimulatedRig final : public SampleStream {
 public:
  SimulatedRig(Rig rig, HandProgram program, SimulatedRigOptions options = {});
  std::optional<Sample> next() override;
  void skip_frames_before(TimePoint time) override { stream_->skip_frames_before(time); }
  const std::shared_ptr<const SimulatedScene>& scene() const { return scene_; }

 private:
  std::shared_ptr<const SimulatedScene> scene_;
  std::unique_ptr<MergedStream> stream_;
};

}  // namespace handloft::tracking
