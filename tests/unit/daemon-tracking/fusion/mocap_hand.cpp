#include "tests/unit/daemon-tracking/fusion/mocap_hand.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>

#include "daemon-tracking/vision/camera_model.h"

namespace handloft::tracking::test {

namespace {

std::vector<std::string> columns_of(const std::string& line) {
  std::vector<std::string> out;
  std::istringstream stream(line);
  for (std::string column; std::getline(stream, column, '\t');) out.push_back(column);
  return out;
}

double number_of(const std::vector<std::string>& row, std::size_t column) {
  if (column >= row.size() || row[column].empty()) return 0.0;
  return std::stod(row[column]);
}

}  // namespace

MocapHand::MocapHand(const std::filesystem::path& recording) {
  std::ifstream file(recording);
  std::array<std::size_t, finger_count> first_column{};
  const std::array<std::string, finger_count> names{"thumb_tip X", "index_tip X", "middle_tip X",
                                                    "ring_tip X", "little_tip X"};
  bool in_table = false;
  Eigen::Vector3d sum(0, 0, 0);
  double count = 0;
  for (std::string line; std::getline(file, line);) {
    const auto row = columns_of(line);
    if (!in_table) {
      if (row.empty() || row[0] != "Frame") continue;
      for (std::size_t f = 0; f < names.size(); ++f) {
        const auto found = std::find(row.begin(), row.end(), names[f]);
        if (found == row.end()) throw std::runtime_error("the recording lacks " + names[f]);
        first_column[f] = static_cast<std::size_t>(found - row.begin());
      }
      in_table = true;
      continue;
    }
    auto& frame = frames_.emplace_back();
    for (std::size_t f = 0; f < names.size(); ++f) {
      const Eigen::Vector3d mm(number_of(row, first_column[f]), number_of(row, first_column[f] + 1),
                               number_of(row, first_column[f] + 2));
      if (!mm.allFinite() || mm.norm() < 1e-6) continue;  // Hidden
      frame[f] = mm * 1e-3;
      sum += *frame[f];
      ++count;
    }
  }
  if (frames_.size() < 2) throw std::runtime_error("the recording has no frames");
  const Eigen::Vector3d middle = sum / count;
  for (auto& frame : frames_)
    for (auto& tip : frame)
      if (tip) *tip -= middle;
}

std::optional<Eigen::Vector3d> MocapHand::tip(Finger finger, double time_s) const {
  const double at = time_s * rate_hz;
  if (!(at >= 0.0) || at > static_cast<double>(frames_.size() - 2)) return std::nullopt;
  const auto index = static_cast<std::size_t>(at);
  const auto& before = frames_[index][static_cast<std::size_t>(finger)];
  const auto& after = frames_[index + 1][static_cast<std::size_t>(finger)];
  if (!before || !after) return std::nullopt;
  const double share = at - static_cast<double>(index);
  return *before + share * (*after - *before);
}

Rig arc_rig(int cameras) {
  constexpr double arc_rad = 70.0 * std::numbers::pi / 180.0;
  constexpr double distance_m = 0.85;
  Rig rig;
  for (int i = 0; i < cameras; ++i) {
    const double angle = cameras > 1 ? arc_rad * (static_cast<double>(i) / (cameras - 1) - 0.5) : 0.0;
    CameraCalibration camera;
    camera.name = "camera " + std::to_string(i);
    camera.intrinsics.distortion = {-0.1, 0.03, 0.0005, -0.0004, 0.0};
    const Eigen::Vector3d position(distance_m * std::sin(angle), -distance_m * std::cos(angle) * 0.8,
                                   distance_m * std::cos(angle) * 0.6);
    const Eigen::Vector3d forward = -position.normalized();
    const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
    camera.world_from_camera.linear().col(0) = right;
    camera.world_from_camera.linear().col(1) = forward.cross(right);
    camera.world_from_camera.linear().col(2) = forward;
    camera.world_from_camera.translation() = position;
    rig.cameras.push_back(camera);
  }
  for (int f = 0; f < finger_count; ++f)
    rig.colours[static_cast<std::size_t>(f)].finger = static_cast<Finger>(f);
  return rig;
}

std::vector<CameraObservation> watch(const MocapHand& hand, const Rig& rig, double noise_px,
                                     std::uint32_t seed) {
  constexpr double frame_s = 1.0 / 30.0;
  constexpr double apart = 12.0;  // Log likelihood between two hues
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  std::vector<CameraObservation> out;
  for (std::uint32_t c = 0; c < rig.cameras.size(); ++c) {
    const CameraModel model = CameraModel::create(rig.cameras[c].intrinsics).value();
    const Eigen::Isometry3d camera_from_world = rig.cameras[c].world_from_camera.inverse();
    const double beat_s =
        frame_s * (1.0 + 1e-4 * normal(random));  // Free-running: phases drift past each other
    double time_s = frame_s * uniform(random);
    for (std::uint64_t sequence = 0; time_s < hand.duration_s(); ++sequence, time_s += beat_s) {
      CameraObservation& observation = out.emplace_back();
      observation.camera = c;
      observation.sequence = sequence;
      observation.capture_time = mocap_start + from_seconds(time_s);
      for (int f = 0; f < finger_count; ++f) {
        const auto tip = hand.tip(static_cast<Finger>(f), time_s);
        if (!tip) continue;
        const auto pixel = model.project(camera_from_world * *tip);
        if (!pixel || !model.contains(*pixel)) continue;
        FingertipBlob& blob = observation.blobs.emplace_back();
        blob.finger = static_cast<Finger>(f);
        blob.centre_px = *pixel + noise_px * Eigen::Vector2d(normal(random), normal(random));
        blob.covariance = Eigen::Matrix2d::Identity() * noise_px * noise_px;
        blob.area_px = 120.0;
        blob.log_likelihood.fill(-apart);
        blob.log_likelihood[static_cast<std::size_t>(f)] = normal(random);
        if (uniform(random) < 0.03)
          blob.log_likelihood[static_cast<std::size_t>((f + 1) % finger_count)] =
              blob.log_likelihood[static_cast<std::size_t>(f)];
      }
    }
  }
  std::stable_sort(out.begin(), out.end(), [](const CameraObservation& a, const CameraObservation& b) {
    return a.capture_time < b.capture_time;
  });
  return out;
}

}  // namespace handloft::tracking::test
