#include "daemon-tracking/fusion/head_filter.h"

#include <fmt/core.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "daemon-tracking/fusion/prediction.h"

namespace handloft::tracking {

namespace {

constexpr std::size_t max_head_cameras = 16;

Eigen::Isometry3d isometry(const Eigen::Vector3d& position, const Eigen::Quaterniond& orientation) {
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.linear() = orientation.toRotationMatrix();
  out.translation() = position;
  return out;
}

}  // namespace

HeadFilter::HeadFilter(std::vector<Camera> cameras, const Rig& rig, const HeadFilterOptions& options)
    : cameras_(std::move(cameras)),
      head_tags_(rig.head_tags),
      table_tags_(rig.table_tags),
      options_(options) {}

Result<HeadFilter> HeadFilter::create(const Rig& rig, const HeadFilterOptions& options) {
  if (rig.cameras.size() > max_head_cameras)
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found {} cameras, expected at most {}", rig.cameras.size(), max_head_cameras),
        "rig.cameras");
  std::vector<Camera> cameras;
  for (const CameraCalibration& calibration : rig.cameras) {
    auto model = CameraModel::create(calibration.intrinsics);
    if (!model) return model.error();
    const auto& pose =
        calibration.role == CameraRole::table ? calibration.world_from_camera : calibration.head_from_camera;
    if (!pose.matrix().allFinite())
      return make_error(ErrorCode::invalid_argument, "found a pose that is not finite",
                        fmt::format("cameras.{}", calibration.name));
    cameras.push_back({*model, calibration, pose});
  }
  for (const auto* tags : {&rig.head_tags, &rig.table_tags})
    for (const TagPlacement& tag : *tags)
      if (!tag.body_from_tag.matrix().allFinite() || !(tag.edge_m > 1e-4) || !std::isfinite(tag.edge_m))
        return make_error(ErrorCode::invalid_argument,
                          fmt::format("tag {} has no proper place or edge", tag.id), "rig.tags");
  return HeadFilter(std::move(cameras), rig, options);
}

Status HeadFilter::update(const CameraObservation& observation) {
  if (observation.camera >= cameras_.size())
    return make_error(ErrorCode::not_found, fmt::format("the rig has no camera {}", observation.camera),
                      "camera");
  const Camera& camera = cameras_[observation.camera];
  const bool on_table = camera.calibration.role == CameraRole::table;
  Measurement measurement;
  measurement.camera = observation.camera;
  measurement.time = observation.capture_time;
  measurement.view =
      make_view(camera.model, on_table ? CameraOn::base : CameraOn::body, camera.carrier_from_camera,
                observation.tags, on_table ? head_tags_ : table_tags_);
  for (const CornerMeasurement& corner : measurement.view.corners)
    if (!corner.pixel.allFinite())
      return make_error(ErrorCode::invalid_argument, "found a corner that is not finite", "tags.corners_px");
  const auto insertion =
      history_.insert(std::move(measurement), State{}, options_.history, options_.latest_late,
                      [this](State& state, const Measurement& one) { apply(state, one); });
  if (insertion == Insertion::too_late) {
    ++dropped_;
    return make_error(ErrorCode::failed_precondition, "the observation is older than the history",
                      "capture_time");
  }
  if (insertion == Insertion::replayed) ++replayed_;
  newest_ = history_.entries().back().measurement.time;
  return {};
}

void HeadFilter::apply(State& state, const Measurement& measurement) const {
  // The camera's model lies in this object, which may have been moved since the view was made.
  Measurement view = measurement;
  view.view.camera = &cameras_[measurement.camera].model;
  if (state.alive && measurement.time - state.last_update > options_.predicted_within) state.alive = false;
  if (view.view.corners.empty()) return;
  if (!state.alive) {
    start(state, view);
    return;
  }
  State next = state;
  Correction correction = correct(next, view, 1.0);
  if (correction != Correction::accepted) {
    next = state;
    correction = correct(next, view, options_.jerk_factor);
  }
  if (correction != Correction::refused) {
    state = next;
    state.gated_running = 0;
    return;
  }
  ++state.counters.gated;
  if (++state.gated_running >= options_.gated_before_reset) {
    state.alive = false;
    state.gated_running = 0;
    ++state.counters.resets;
    start(state, view);
  }
}

bool HeadFilter::start(State& state, const Measurement& measurement) const {
  const std::array<BodyView, 1> views{measurement.view};
  const auto pose = solve_body_pose(views, std::nullopt, options_.pose);
  if (!pose || pose->ambiguity_ratio < options_.min_ambiguity_ratio) return false;
  const double tilt_variance = pose->covariance.bottomRightCorner<3, 3>().diagonal().maxCoeff();
  if (tilt_variance > options_.max_start_tilt_rad * options_.max_start_tilt_rad) return false;
  const Counters counters = state.counters;
  state = State{};
  state.counters = counters;
  state.alive = true;
  state.time = state.last_update = measurement.time;
  state.position = pose->base_from_body.translation();
  state.orientation = Eigen::Quaterniond(pose->base_from_body.linear()).normalized();
  state.covariance.setZero();
  // The start's covariance is doubled: it comes from one view with unmodelled faults.
  state.covariance.topLeftCorner<6, 6>() = 4.0 * pose->covariance;
  state.covariance.diagonal().segment<3>(6).setConstant(options_.initial_velocity_sigma *
                                                        options_.initial_velocity_sigma);
  state.covariance.diagonal().tail<3>().setConstant(options_.initial_angular_sigma *
                                                    options_.initial_angular_sigma);
  state.seen_ns[measurement.camera] = std::max<std::int64_t>(to_ns(measurement.time), 1);
  state.rms_px = pose->reprojection_rms_px;
  state.tags = static_cast<std::uint32_t>(pose->tags);
  ++state.counters.updates;
  return true;
}

void HeadFilter::predict(State& state, TimePoint time, double density_factor) const {
  const double dt_s = to_seconds(time - state.time);
  if (dt_s <= 0.0) return;
  const double tau = options_.velocity_decay_s;
  const double way = tau * -std::expm1(-dt_s / tau);
  const double decay = std::exp(-dt_s / tau);
  state.position += way * state.velocity;
  state.orientation = (rotation_from_vector(way * state.angular_velocity) * state.orientation).normalized();
  state.velocity *= decay;
  state.angular_velocity *= decay;
  Matrix12d transition = Matrix12d::Identity();
  transition.topRightCorner<6, 6>().diagonal().setConstant(way);
  transition.bottomRightCorner<6, 6>().diagonal().setConstant(decay);
  // A turn of the head turns the rotation error with it.
  transition.block<3, 3>(3, 3) = rotation_from_vector(way * state.angular_velocity).toRotationMatrix();
  state.covariance = transition * state.covariance * transition.transpose();
  const double step = std::min(dt_s, options_.max_step_s);
  for (int axis = 0; axis < 6; ++axis) {
    const double density =
        density_factor * (axis < 3 ? options_.acceleration_density : options_.angular_density);
    const double q = density * density;
    state.covariance(axis, axis) += q * step * step * step / 3.0;
    state.covariance(axis, axis + 6) += q * step * step / 2.0;
    state.covariance(axis + 6, axis) += q * step * step / 2.0;
    state.covariance(axis + 6, axis + 6) += q * step;
  }
  state.time = time;
}

HeadFilter::Correction HeadFilter::correct(State& state, const Measurement& measurement,
                                           double density_factor) const {
  State next = state;
  predict(next, measurement.time, density_factor);
  BodyPoseOptions pose_options = options_.pose;
  // Errors that all corners of a view share do not average out: every corner is trusted that much less.
  const double corners = static_cast<double>(measurement.view.corners.size());
  pose_options.corner_sigma_px = std::sqrt(options_.corner_sigma_px * options_.corner_sigma_px +
                                           corners * options_.common_sigma_px * options_.common_sigma_px);
  const CameraCalibration& camera = cameras_[measurement.camera].calibration;
  std::vector<double> delays_s;
  delays_s.reserve(measurement.view.corners.size());
  for (const CornerMeasurement& corner : measurement.view.corners)
    delays_s.push_back(camera.row_delay_s(corner.pixel.y()));
  MovingBody prior;
  prior.base_from_body = isometry(next.position, next.orientation);
  prior.rate << next.velocity, next.angular_velocity;
  prior.covariance = next.covariance;
  const auto fit = correct_moving_body(measurement.view, delays_s, prior, pose_options);
  if (!fit || fit->reprojection_rms_px > options_.gate_rms_px) return Correction::refused;
  next.covariance = fit->body.covariance;
  next.position = fit->body.base_from_body.translation();
  next.orientation = Eigen::Quaterniond(fit->body.base_from_body.linear()).normalized();
  next.velocity = fit->body.rate.head<3>();
  next.angular_velocity = fit->body.rate.tail<3>();
  next.last_update = measurement.time;
  next.seen_ns[measurement.camera] = std::max<std::int64_t>(to_ns(measurement.time), 1);
  next.rms_px = fit->reprojection_rms_px;
  next.tags = static_cast<std::uint32_t>(fit->tags);
  if (!next.position.allFinite() || !next.orientation.coeffs().allFinite() || !next.velocity.allFinite() ||
      !next.angular_velocity.allFinite() || !next.covariance.allFinite() ||
      next.covariance.diagonal().minCoeff() <= 0.0)
    return Correction::refused;
  state = next;
  ++state.counters.updates;
  return fit->surprise > options_.jerk_nis ? Correction::surprising : Correction::accepted;
}

FusedHead HeadFilter::head_at_time(TimePoint time, const PredictionLimits& limits) const {
  FusedHead out;
  if (history_.empty()) return out;
  const State& state = history_.newest();
  out.position_m = state.position;
  out.orientation = state.orientation;
  out.velocity_m_s = state.velocity;
  out.angular_velocity_rad_s = state.angular_velocity;
  out.covariance = state.covariance.topLeftCorner<6, 6>();
  out.reprojection_rms_px = state.rms_px;
  out.tags = state.tags;
  const Duration unseen = time - state.last_update;
  if (!state.alive || unseen > options_.predicted_within) return out;
  out = tracking::predict(out, to_seconds(unseen), limits);
  for (std::size_t camera = 0; camera < state.seen_ns.size(); ++camera)
    if (state.seen_ns[camera] != 0 && to_ns(time) - state.seen_ns[camera] <= options_.tracked_within.count())
      out.camera_mask |= 1u << camera;
  out.position_valid = out.orientation_valid = true;
  out.position_tracked = out.orientation_tracked = unseen <= options_.tracked_within;
  out.state = out.position_tracked ? TrackingState::tracked : TrackingState::predicted;
  return out;
}

HeadAt HeadFilter::at(TimePoint time, const PredictionLimits& limits) const {
  HeadAt out;
  if (history_.empty()) return out;
  const State& newest = history_.newest();
  if (newest.alive && time >= newest.last_update) {
    const FusedHead head = head_at_time(time, limits);
    if (!head.position_valid) return out;
    return {time == newest.last_update ? ResultKind::exact : ResultKind::predicted, head.position_m,
            head.orientation};
  }
  const State* later = nullptr;
  for (auto entry = history_.entries().rbegin(); entry != history_.entries().rend(); ++entry) {
    const State& state = entry->after;
    if (!state.alive) return out;
    if (state.last_update > time) {
      later = &state;
      continue;
    }
    if (state.last_update == time) return {ResultKind::exact, state.position, state.orientation};
    if (later == nullptr) return out;
    const double share =
        to_seconds(time - state.last_update) / to_seconds(later->last_update - state.last_update);
    return {ResultKind::interpolated, state.position + share * (later->position - state.position),
            state.orientation.slerp(share, later->orientation)};
  }
  return out;
}

HeadFilter::Counters HeadFilter::counters() const {
  Counters out = history_.empty() ? Counters{} : history_.newest().counters;
  out.replayed = replayed_;
  out.dropped = dropped_;
  return out;
}

void HeadFilter::reset() {
  history_.clear();
}

}  // namespace handloft::tracking
