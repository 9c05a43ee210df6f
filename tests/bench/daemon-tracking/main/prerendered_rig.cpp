#include "tests/bench/daemon-tracking/main/prerendered_rig.h"

#include <algorithm>
#include <utility>

#include "daemon-tracking/source/simulated/simulated_rig.h"
#include "daemon-tracking/source/simulated/tour_program.h"

namespace handloft::tracking {

namespace {

constexpr TimePoint start = from_ns(1'000'000'000);

class ListStream final : public SampleStream {
 public:
  explicit ListStream(const std::vector<Sample>& samples) : samples_(samples) {}
  std::optional<Sample> next() override {
    if (next_ == samples_.size()) return std::nullopt;
    return samples_[next_++];
  }

 private:
  const std::vector<Sample>& samples_;
  std::size_t next_ = 0;
};

}  // namespace

Rig rig_with_cameras(int cameras) {
  Rig rig = default_rig();
  if (cameras >= 4) {
    // The left camera's lens, half way round the table's corner: what it sees is much like what that one
    // does.
    CameraCalibration side = rig.cameras[0];
    side.name = "side";
    const Eigen::AngleAxisd about_the_work(0.5, Eigen::Vector3d::UnitZ());
    side.world_from_camera = Eigen::Isometry3d(about_the_work) * side.world_from_camera;
    rig.cameras.push_back(side);
  }
  rig.cameras.resize(static_cast<std::size_t>(std::clamp(cameras, 2, 4)));
  return rig;
}

PrerenderedSession prerender(int cameras, double rate_hz, double seconds) {
  PrerenderedSession session;
  session.rig = rig_with_cameras(cameras);
  SimulatedRigOptions options;
  options.start = start;
  options.frames_per_s = rate_hz;
  SimulatedRig rig(session.rig, tour_program({}), options);
  while (std::optional<Sample> sample = rig.next()) {
    if (delivery_time(*sample) > start + from_seconds(seconds)) break;
    // The truth is for accuracy; a real rig tells none.
    if (!std::holds_alternative<Truth>(*sample)) session.samples.push_back(std::move(*sample));
  }
  return session;
}

std::unique_ptr<SampleStream> stream_of(const PrerenderedSession& session) {
  return std::make_unique<ListStream>(session.samples);
}

}  // namespace handloft::tracking
