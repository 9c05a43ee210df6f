#include "daemon-tracking/fusion/hand_filter.h"

#include <fmt/core.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "daemon-tracking/fusion/assignment.h"
#include "daemon-tracking/fusion/prediction.h"

namespace handloft::tracking {

namespace {

constexpr std::size_t max_blobs = 32;  // Five fingers have three candidates each; more is not a hand
// A 2D track that must be carried beyond its newest sight may have turned: its pixel is that much less sure
// per second.
constexpr double extrapolation_sigma_px_s = 150.0;
constexpr double longest_extrapolation_s = 0.035;
constexpr double nearest_depth_m = 0.05;  // Nearer to a camera no cap is whole in its image

/// What a camera would see of a tip where and when a blob was exposed, if the tip is there at all.
std::optional<FingertipFilter::Expected> expected_as(const FingertipFilter& tip, const FingertipBlob& blob,
                                                     const CameraModel& model,
                                                     const CameraCalibration& calibration) {
  if (!tip.alive()) return std::nullopt;
  return tip.expected(model, calibration.world_from_camera, calibration.row_delay_s(blob.centre_px.y()));
}

}  // namespace

HandFilter::HandFilter(std::vector<Camera> cameras, double tip_radius_m, const HandFilterOptions& options)
    : cameras_(std::move(cameras)), tip_radius_m_(tip_radius_m), options_(options) {
  for (auto& sights : initial_.sights) sights.resize(cameras_.size());
}

Result<HandFilter> HandFilter::create(const Rig& rig, const HandFilterOptions& options) {
  if (rig.cameras.size() > static_cast<std::size_t>(max_cameras))
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} cameras, expected at most {}", rig.cameras.size(), max_cameras),
                      "rig.cameras");
  std::vector<Camera> cameras;
  for (const CameraCalibration& calibration : rig.cameras) {
    auto model = CameraModel::create(calibration.intrinsics);
    if (!model) return model.error();
    if (!calibration.world_from_camera.matrix().allFinite())
      return make_error(ErrorCode::invalid_argument, "found a pose that is not finite",
                        fmt::format("cameras.{}.world_from_camera", calibration.name));
    cameras.push_back({*model, calibration});
  }
  if (!std::isfinite(rig.fingertip_radius_m) || rig.fingertip_radius_m < 0.0)
    return make_error(ErrorCode::invalid_argument, "found no length, expected metres",
                      "rig.fingertip_radius_m");
  return HandFilter(std::move(cameras), rig.fingertip_radius_m, options);
}

Status HandFilter::update(const CameraObservation& observation) {
  if (observation.camera >= cameras_.size())
    return make_error(ErrorCode::not_found, fmt::format("the rig has no camera {}", observation.camera),
                      "camera");
  if (cameras_[observation.camera].calibration.role != CameraRole::table)
    return make_error(ErrorCode::unsupported, "fingertips are taken from table cameras only", "camera");
  Measurement measurement;
  measurement.camera = observation.camera;
  measurement.time = observation.capture_time;
  for (const FingertipBlob& blob : observation.blobs) {
    if (measurement.blobs.size() >= max_blobs) break;
    if (!blob.centre_px.allFinite() || !blob.covariance.allFinite() ||
        !(blob.covariance.determinant() > 0.0) || !std::isfinite(blob.area_px) ||
        static_cast<int>(blob.finger) >= finger_count)
      continue;
    measurement.blobs.push_back(blob);
  }
  const auto insertion =
      history_.insert(std::move(measurement), initial_, options_.history, options_.latest_late,
                      [this](State& state, const Measurement& one) { apply(state, one); });
  if (insertion == Insertion::too_late) {
    ++dropped_;
    return make_error(ErrorCode::failed_precondition, "the observation is older than the history",
                      "capture_time");
  }
  if (insertion == Insertion::replayed) ++replayed_;
  newest_ = history_.newest().time;
  return {};
}

double HandFilter::colour_cost(const FingertipBlob& blob, int finger) const {
  const double best = *std::max_element(blob.log_likelihood.begin(), blob.log_likelihood.end());
  const double cost = options_.colour_weight * (best - blob.log_likelihood[static_cast<std::size_t>(finger)]);
  return std::isfinite(cost) ? cost : 2.0 * options_.miss_cost;
}

Eigen::Matrix2d HandFilter::blob_covariance(const FingertipFilter& tip, const FingertipBlob& blob,
                                            const Camera& camera) const {
  Eigen::Matrix2d covariance =
      blob.covariance + Eigen::Matrix2d::Identity() * options_.model_sigma_px * options_.model_sigma_px;
  if (!tip.alive()) return covariance;
  // Of a cap that is hidden in part the blob's centre is off towards what shows, in frame after frame.
  const double depth = (camera.calibration.world_from_camera.inverse() * tip.position()).z();
  if (depth < nearest_depth_m) return covariance;
  const double radius_px = camera.model.intrinsics().fx_px * tip_radius_m_ / depth;
  const double share = blob.area_px / (options_.whole_share * std::numbers::pi * radius_px * radius_px);
  if (share < 1.0) {
    const double sigma = options_.hidden_bias * radius_px * (1.0 - share) * (1.0 - share);
    covariance += Eigen::Matrix2d::Identity() * sigma * sigma;
  }
  return covariance;
}

void HandFilter::apply(State& state, const Measurement& measurement) const {
  state.time = measurement.time;
  for (FingertipFilter& tip : state.tips)
    if (tip.alive() && measurement.time - tip.last_update() > options_.predicted_within) tip.kill();
  std::array<int, finger_count> blob_of_finger{};
  associate(state, measurement, blob_of_finger);
  repair_labels(state, measurement, blob_of_finger);
  const Camera& camera = cameras_[measurement.camera];
  for (int finger = 0; finger < finger_count; ++finger) {
    const auto f = static_cast<std::size_t>(finger);
    FingertipFilter& tip = state.tips[f];
    if (!tip.alive() || blob_of_finger[f] < 0) continue;
    const FingertipBlob& blob = measurement.blobs[static_cast<std::size_t>(blob_of_finger[f])];
    FingertipFilter carried;
    std::optional<FingertipFilter::Expected> expected;
    Eigen::Matrix2d covariance;
    double nis = 0.0;
    // Once as it moved so far; if that surprises, once more as a finger that jerks.
    for (bool again = true; again;) {
      again = false;
      carried = tip;
      carried.predict(measurement.time, options_.tip);
      expected = expected_as(carried, blob, camera.model, camera.calibration);
      if (!expected) break;
      covariance = blob_covariance(carried, blob, camera);
      const Eigen::Vector2d innovation = blob.centre_px - expected->pixel;
      nis = innovation.dot((expected->covariance + covariance).inverse() * innovation);
      if (nis > options_.tip.jerk_nis && !tip.jerking()) {
        tip.jerk(measurement.time - tip.time() + options_.tip.jerk_for);
        again = true;
      }
    }
    if (!expected) {
      tip.kill();
      ++state.counters.resets;
      continue;
    }
    if (!(nis <= options_.gate_nis)) {
      ++state.counters.gated;
      if (++tip.gated_running >= options_.gated_before_reset) {
        tip.kill();
        ++state.counters.resets;
      }
      continue;
    }
    tip = carried;
    tip.update(*expected, blob.centre_px, covariance, measurement.camera, measurement.time);
    ++state.counters.updates;
    if (!tip.alive()) ++state.counters.resets;
  }
  move_unsure_with_hand(state);
  drop_merged(state);
  remember_sights(state, measurement, blob_of_finger);
  for (int finger = 0; finger < finger_count; ++finger)
    if (!state.tips[static_cast<std::size_t>(finger)].alive() &&
        blob_of_finger[static_cast<std::size_t>(finger)] >= 0)
      place_finger(state, finger, measurement);
}

void HandFilter::associate(State& state, const Measurement& measurement,
                           std::array<int, finger_count>& blob_of_finger) const {
  blob_of_finger.fill(-1);
  if (measurement.blobs.empty()) return;
  const Camera& camera = cameras_[measurement.camera];
  Eigen::MatrixXd cost(finger_count, static_cast<Eigen::Index>(measurement.blobs.size()));
  for (int finger = 0; finger < finger_count; ++finger) {
    FingertipFilter tip = state.tips[static_cast<std::size_t>(finger)];
    tip.predict(measurement.time, options_.tip);
    for (std::size_t b = 0; b < measurement.blobs.size(); ++b) {
      const FingertipBlob& blob = measurement.blobs[b];
      const auto expected = expected_as(tip, blob, camera.model, camera.calibration);
      double value = colour_cost(blob, finger);
      if (expected) {
        const Eigen::Matrix2d covariance = expected->covariance + blob_covariance(tip, blob, camera);
        const Eigen::Vector2d innovation = blob.centre_px - expected->pixel;
        // Capped: a blob of the right colour that jumped is refused by the gate and counted, not handed to
        // another.
        value += std::min(0.5 * innovation.dot(covariance.inverse() * innovation), 0.9 * options_.miss_cost);
      } else {
        value += options_.unplaced_cost - 1e-3 * std::min(blob.area_px, 1000.0);
      }
      cost(finger, static_cast<Eigen::Index>(b)) = value;
    }
  }
  const auto columns = assign(cost, options_.miss_cost);
  for (std::size_t finger = 0; finger < finger_count; ++finger) blob_of_finger[finger] = columns[finger];
}

void HandFilter::repair_labels(State& state, const Measurement& measurement,
                               const std::array<int, finger_count>& blob_of_finger) const {
  // Two filters that carry each other's names: every blob would fit better, by place, to the other's filter.
  const Camera& camera = cameras_[measurement.camera];
  const auto distance = [&](std::size_t filter, std::size_t blob_finger) -> std::optional<double> {
    FingertipFilter tip = state.tips[filter];
    tip.predict(measurement.time, options_.tip);
    if (blob_of_finger[blob_finger] < 0) return std::nullopt;
    const FingertipBlob& blob = measurement.blobs[static_cast<std::size_t>(blob_of_finger[blob_finger])];
    const auto expected = expected_as(tip, blob, camera.model, camera.calibration);
    if (!expected) return std::nullopt;
    const Eigen::Matrix2d covariance = expected->covariance + blob_covariance(tip, blob, camera);
    const Eigen::Vector2d innovation = blob.centre_px - expected->pixel;
    return 0.5 * innovation.dot(covariance.inverse() * innovation);
  };
  for (std::size_t i = 0; i < finger_count; ++i) {
    for (std::size_t j = i + 1; j < finger_count; ++j) {
      const auto own_i = distance(i, i), own_j = distance(j, j), cross_i = distance(i, j),
                 cross_j = distance(j, i);
      if (!own_i || !own_j || !cross_i || !cross_j) continue;
      int& votes = state.swap_votes[i][j];
      votes = *cross_i + *cross_j + options_.swap_margin < *own_i + *own_j ? votes + 1 : 0;
      if (votes < options_.swap_frames) continue;
      std::swap(state.tips[i], state.tips[j]);
      votes = 0;
      ++state.counters.swaps;
    }
  }
}

void HandFilter::move_unsure_with_hand(State& state) const {
  for (FingertipFilter& tip : state.tips) {
    if (!tip.alive() || tip.last_update() != state.time || tip.position_sigma_m() <= options_.unsure_sigma_m)
      continue;
    const FingertipFilter* nearest = nullptr;
    for (const FingertipFilter& other : state.tips)
      if (other.alive() && other.position_sigma_m() <= options_.unsure_sigma_m &&
          (nearest == nullptr ||
           (other.position() - tip.position()).norm() < (nearest->position() - tip.position()).norm()))
        nearest = &other;
    if (nearest != nullptr) tip.update_velocity(nearest->velocity(), options_.hand_velocity_sigma);
  }
}

void HandFilter::drop_merged(State& state) const {
  for (std::size_t i = 0; i < finger_count; ++i) {
    for (std::size_t j = i + 1; j < finger_count; ++j) {
      FingertipFilter& a = state.tips[i];
      FingertipFilter& b = state.tips[j];
      if (!a.alive() || !b.alive()) continue;
      if ((a.position() - b.position()).norm() >= options_.min_tip_distance_m) continue;
      const bool a_worse =
          a.covariance().topLeftCorner<3, 3>().trace() > b.covariance().topLeftCorner<3, 3>().trace();
      (a_worse ? a : b).kill();
      ++state.counters.resets;
    }
  }
}

void HandFilter::remember_sights(State& state, const Measurement& measurement,
                                 const std::array<int, finger_count>& blob_of_finger) const {
  for (std::size_t finger = 0; finger < finger_count; ++finger) {
    if (blob_of_finger[finger] < 0) continue;
    const FingertipBlob& blob = measurement.blobs[static_cast<std::size_t>(blob_of_finger[finger])];
    auto& sights = state.sights[finger][measurement.camera];
    sights[1] = sights[0];
    const double delay_s = cameras_[measurement.camera].calibration.row_delay_s(blob.centre_px.y());
    sights[0] = {
        true, measurement.time + from_seconds(delay_s), blob.centre_px,
        blob.covariance + Eigen::Matrix2d::Identity() * options_.model_sigma_px * options_.model_sigma_px};
  }
}

void HandFilter::place_finger(State& state, int finger, const Measurement& measurement) const {
  const auto& sights = state.sights[static_cast<std::size_t>(finger)];
  const auto recent = [&](const Sight& sight) {
    return sight.seen && measurement.time - sight.time <= options_.sight_span;
  };
  // The common time is the newest at which another camera saw the finger; every camera's own track is brought
  // there, between its two sights where it can be.
  std::optional<TimePoint> common;
  for (std::size_t camera = 0; camera < cameras_.size(); ++camera)
    if (camera != measurement.camera && recent(sights[camera][0]) &&
        (!common || sights[camera][0].time > *common))
      common = sights[camera][0].time;
  if (!common) return;
  std::vector<PointView> views;
  std::vector<std::size_t> view_cameras;
  for (std::size_t camera = 0; camera < cameras_.size(); ++camera) {
    const Sight& newest = sights[camera][0];
    const Sight& before = sights[camera][1];
    if (!recent(newest)) continue;
    PointView view{&cameras_[camera].model, cameras_[camera].calibration.world_from_camera, newest.pixel,
                   newest.covariance};
    const double ahead_s = to_seconds(*common - newest.time);
    const bool track =
        before.seen && newest.time > before.time && newest.time - before.time <= options_.sight_span;
    if (std::abs(ahead_s) > longest_extrapolation_s) continue;
    if (track) {
      const double share = ahead_s / to_seconds(newest.time - before.time);
      view.pixel += share * (newest.pixel - before.pixel);
    }
    const bool between = track && ahead_s <= 0.0 && *common >= before.time;
    if (!between) {
      const double sigma = extrapolation_sigma_px_s * std::abs(ahead_s) * (track ? 1.0 : 3.0);
      view.covariance += Eigen::Matrix2d::Identity() * sigma * sigma;
    }
    views.push_back(view);
    view_cameras.push_back(camera);
  }
  const auto point = triangulate(views, options_.triangulation);
  if (!point) return;
  FingertipFilter& tip = state.tips[static_cast<std::size_t>(finger)];
  tip.start(*common, point->position_m, point->covariance, options_.tip);
  for (std::size_t camera : view_cameras) tip.mark_seen(static_cast<std::uint32_t>(camera), *common);
  ++state.counters.updates;
}

FusedTip HandFilter::describe(const FingertipFilter& tip, TimePoint time,
                              const PredictionLimits& limits) const {
  FusedTip out;
  out.position_m = tip.position();
  out.velocity_m_s = tip.velocity();
  out.covariance_m2 = tip.covariance().topLeftCorner<3, 3>();
  if (!tip.alive()) return out;
  out.camera_mask = tip.cameras_within(time, options_.tracked_within);
  out = predict(out, to_seconds(time - tip.last_update()), limits);
  const Duration unseen = time - tip.last_update();
  if (unseen > options_.predicted_within) {
    out.state = TrackingState::lost;
  } else if (out.camera_mask == 0) {
    out.state = TrackingState::predicted;
  } else {
    out.state = std::popcount(out.camera_mask) >= 2 ? TrackingState::tracked : TrackingState::single;
  }
  return out;
}

std::array<FusedTip, finger_count> HandFilter::tips() const {
  return tips_at(newest_, PredictionLimits{});
}

std::array<FusedTip, finger_count> HandFilter::tips_at(TimePoint time, const PredictionLimits& limits) const {
  std::array<FusedTip, finger_count> out;
  if (history_.empty()) return out;
  for (std::size_t finger = 0; finger < finger_count; ++finger)
    out[finger] = describe(history_.newest().tips[finger], time, limits);
  return out;
}

TipAt HandFilter::at(Finger finger, TimePoint time, const PredictionLimits& limits) const {
  TipAt out;
  const auto f = static_cast<std::size_t>(finger);
  if (history_.empty() || f >= finger_count) return out;
  const FingertipFilter& newest = history_.newest().tips[f];
  if (newest.alive() && time > newest.last_update()) {
    const FusedTip tip = describe(newest, time, limits);
    if (tip.state == TrackingState::lost) return out;
    return {ResultKind::predicted, tip.position_m, tip.velocity_m_s, tip.covariance_m2};
  }
  // The filtered states at this finger's updates, from the first after `time` onwards, and the last before
  // it.
  std::vector<const FingertipFilter*> later;
  const FingertipFilter* earlier = nullptr;
  for (auto entry = history_.entries().rbegin(); entry != history_.entries().rend(); ++entry) {
    const FingertipFilter& tip = entry->after.tips[f];
    if (!tip.alive()) break;
    if (!later.empty() && tip.last_update() == later.back()->last_update()) continue;
    if (tip.last_update() > time) {
      later.push_back(&tip);
    } else {
      earlier = &tip;
      break;
    }
  }
  if (earlier == nullptr) return out;
  // Backwards from the newest (Rauch, Tung, Striebel), last to `time` itself, which stands between two
  // updates.
  Vector6d smooth_mean = later.empty() ? earlier->mean() : later.front()->mean();
  Matrix6d smooth_covariance = later.empty() ? earlier->covariance() : later.front()->covariance();
  const auto step_back = [&](const Vector6d& mean, const Matrix6d& covariance, double dt_s, double density) {
    Matrix6d transition, noise;
    FingertipFilter::motion(dt_s, density, options_.tip, transition, noise);
    const Matrix6d predicted = transition * covariance * transition.transpose() + noise;
    const Matrix6d gain = Eigen::LDLT<Matrix6d>(predicted).solve(transition * covariance).transpose();
    smooth_mean = mean + gain * (smooth_mean - transition * mean);
    smooth_covariance = covariance + gain * (smooth_covariance - predicted) * gain.transpose();
  };
  for (std::size_t i = 1; i < later.size(); ++i)
    step_back(later[i]->mean(), later[i]->covariance(), to_seconds(later[i - 1]->time() - later[i]->time()),
              later[i - 1]->density());
  if (!later.empty()) {
    FingertipFilter between = *earlier;
    between.predict(time, options_.tip);
    if (!between.alive()) return out;
    step_back(between.mean(), between.covariance(), to_seconds(later.back()->time() - time),
              later.back()->density());
  }
  out.kind = earlier->last_update() == time ? ResultKind::exact : ResultKind::interpolated;
  out.position_m = smooth_mean.head<3>();
  out.velocity_m_s = smooth_mean.tail<3>();
  out.covariance_m2 = smooth_covariance.topLeftCorner<3, 3>();
  if (!out.position_m.allFinite() || !out.covariance_m2.allFinite()) return TipAt{};
  return out;
}

HandFilter::Counters HandFilter::counters() const {
  Counters out = history_.empty() ? Counters{} : history_.newest().counters;
  out.replayed = replayed_;
  out.dropped = dropped_;
  return out;
}

void HandFilter::reset() {
  history_.clear();
}

}  // namespace handloft::tracking
