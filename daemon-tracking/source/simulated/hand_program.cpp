#include "daemon-tracking/source/simulated/hand_program.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "daemon-tracking/source/glove_report.h"
#include "daemon-tracking/source/simulated/hand_model.h"
#include "daemon-tracking/source/simulated/random.h"

namespace handloft::tracking {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
constexpr double pi = std::numbers::pi;

/// Minimum-jerk course from 0 to 1 (Flash and Hogan 1985, eq. 4).
double minimum_jerk(double u) {
  return u * u * u * (10.0 - 15.0 * u + 6.0 * u * u);
}

/// The fraction of the time at which `way` of the course is done: its inverse, by bisection.
double time_of_way(double way) {
  double low = 0.0, high = 1.0;
  constexpr int halvings = 40;
  for (int i = 0; i < halvings; ++i) {
    const double middle = (low + high) / 2;
    (minimum_jerk(middle) < way ? low : high) = middle;
  }
  return high;
}

/// Moves that begin or end on the table rise on the way, so that the hand is lifted and not dragged.
constexpr double low_m = 0.03;
constexpr double lift_m = 0.035;
/// Idle sway: amplitude, and turns over the idle time per second.
constexpr double idle_sway_m = 0.004;
constexpr double idle_sway_hz = 0.4;
/// Step for a path's velocity by central... one-sided difference, as a fraction of the stroke.
constexpr double velocity_step = 1e-3;
/// Flexing fingers reach the pads on the palm late in their move, and leave them early.
constexpr double closing_contact = 0.8, opening_contact = 0.2;

/// The palm of an open hand whose fingertips are nearest to `tips`, least squares (Umeyama 1991, without
/// scale).
Eigen::Isometry3d palm_of(const FingerPoints& tips) {
  const FingerPoints open = hand_shape(HandPose::open).fingertips_m;
  Eigen::Matrix<double, 3, finger_count> from, to;
  for (std::size_t i = 0; i < finger_count; ++i) {
    from.col(static_cast<Eigen::Index>(i)) = open[i];
    to.col(static_cast<Eigen::Index>(i)) = tips[i];
  }
  Eigen::Isometry3d palm;
  palm.matrix() = Eigen::umeyama(from, to, false);
  return palm;
}

}  // namespace

Vector3d HandState::centroid_m() const {
  return centroid(fingertips_m);
}

HandProgram::HandProgram(HandOptions options) : options_(options) {}

void HandProgram::append(Segment segment) {
  segment.begin_s = duration_s_;
  duration_s_ += segment.duration_s;
  now_ = segment.to;
  segments_.push_back(std::make_shared<const Segment>(std::move(segment)));
}

void HandProgram::move_to(const Posture& target) {
  const Vector3d start = now_.centroid_m, way = target.centroid_m - start;
  // A moving start or end needs room to brake: twice the time that the speed would take at the usual rate.
  const double moving = (now_.velocity_m_s.norm() + target.velocity_m_s.norm()) / 2;
  const double duration =
      std::max(options_.shortest_transition_s * (1 + moving / options_.transition_speed_m_s / 4),
               way.norm() / options_.transition_speed_m_s);
  const double lift =
      start.z() < low_m || target.centroid_m.z() < low_m ? std::min(lift_m, way.norm() / 3) : 0.0;
  const Vector3d v0 = now_.velocity_m_s * duration, v1 = target.velocity_m_s * duration;
  Segment segment;
  segment.duration_s = duration;
  segment.from = now_;
  segment.to = target;
  segment.contact_pose =
      target.pose == HandPose::on_table || now_.pose == HandPose::on_table ? HandPose::open : target.pose;
  segment.contact_before = now_.pose == HandPose::on_table ? HandPose::open : now_.pose;
  if (segment.contact_before != segment.contact_pose) {
    segment.contact_from = segment.contact_pose == HandPose::open ? opening_contact : closing_contact;
  }
  // The quintic with given end positions and velocities and no acceleration at the ends.
  segment.centroid_m = [=](double u) -> Vector3d {
    const double u3 = u * u * u;
    const Vector3d through = start + minimum_jerk(u) * way + (u + u3 * (-6 + u * (8 - 3 * u))) * v0 +
                             u3 * (-4 + u * (7 - 3 * u)) * v1;
    const double bump = 16 * u * u * (1 - u) * (1 - u);
    return through + lift * bump * Vector3d::UnitZ();
  };
  append(std::move(segment));
}

void HandProgram::idle(double duration_s) {
  Segment segment;
  segment.duration_s = duration_s;
  segment.from = segment.to = now_;
  segment.contact_pose = now_.pose;
  const Vector3d place = now_.centroid_m;
  segment.centroid_m = [=](double u) -> Vector3d {
    const double window = std::sin(pi * u) * std::sin(pi * u);
    const double angle = 2 * pi * idle_sway_hz * duration_s * u;
    return place + idle_sway_m * window * Vector3d(std::sin(angle), std::cos(angle), std::sin(0.7 * angle));
  };
  events_.push_back({HandEvent::Kind::idle, duration_s_, duration_s_ + duration_s, "idle"});
  append(std::move(segment));
}

void HandProgram::follow(std::string label, std::function<Vector3d(double)> path, double duration_s,
                         std::function<double(double)> pressure, const Posture& begin, const Posture& end) {
  move_to(begin);
  Segment segment;
  segment.duration_s = duration_s;
  segment.from = begin;
  segment.to = end;
  segment.centroid_m = std::move(path);
  segment.pressure = std::move(pressure);
  events_.push_back({HandEvent::Kind::stroke, duration_s_, duration_s_ + duration_s, std::move(label)});
  append(std::move(segment));
}

void HandProgram::stroke(std::string label, std::function<Vector3d(double)> path, double duration_s,
                         std::function<double(double)> pressure, const Quaterniond& tilt) {
  Posture begin, end;
  begin.centroid_m = path(0.0);
  end.centroid_m = path(1.0);
  begin.tilt = end.tilt = tilt;
  begin.potentiometer = end.potentiometer = now_.potentiometer;
  auto eased = [path = std::move(path)](double u) { return path(minimum_jerk(u)); };
  auto eased_pressure = [pressure = std::move(pressure)](double u) { return pressure(minimum_jerk(u)); };
  follow(std::move(label), std::move(eased), duration_s, std::move(eased_pressure), begin, end);
}

void HandProgram::timed_stroke(std::string label, std::function<Vector3d(double)> path, double duration_s,
                               std::function<double(double)> pressure, const Quaterniond& tilt) {
  Posture begin, end;
  begin.centroid_m = path(0.0);
  end.centroid_m = path(1.0);
  begin.velocity_m_s = (path(velocity_step) - path(0.0)) / (velocity_step * duration_s);
  end.velocity_m_s = (path(1.0) - path(1.0 - velocity_step)) / (velocity_step * duration_s);
  begin.tilt = end.tilt = tilt;
  begin.potentiometer = end.potentiometer = now_.potentiometer;
  follow(std::move(label), std::move(path), duration_s, std::move(pressure), begin, end);
}

void HandProgram::follow_fingertips(std::string label, std::function<FingerPoints(double)> fingertips,
                                    double duration_s, std::function<double(double)> pressure) {
  const auto middle = [fingertips](double u) -> Vector3d { return centroid(fingertips(u)); };
  Posture begin, end;
  begin.potentiometer = end.potentiometer = now_.potentiometer;
  begin.centroid_m = middle(0.0);
  end.centroid_m = middle(1.0);
  begin.velocity_m_s = (middle(velocity_step) - middle(0.0)) / (velocity_step * duration_s);
  end.velocity_m_s = (middle(1.0) - middle(1.0 - velocity_step)) / (velocity_step * duration_s);
  begin.tilt = Quaterniond(palm_of(fingertips(0.0)).linear());
  end.tilt = Quaterniond(palm_of(fingertips(1.0)).linear());
  move_to(begin);
  Segment segment;
  segment.duration_s = duration_s;
  segment.from = begin;
  segment.to = end;
  segment.centroid_m = middle;
  segment.pressure = std::move(pressure);
  segment.fingertips_m = std::move(fingertips);
  events_.push_back({HandEvent::Kind::stroke, duration_s_, duration_s_ + duration_s, std::move(label)});
  append(std::move(segment));
}

void HandProgram::act(HandEvent::Kind kind, std::string label, std::function<Vector3d(double)> path,
                      double duration_s, std::function<double(double)> pressure, const Posture& with,
                      const Quaterniond& last_tilt, const std::vector<double>& thumb_taps) {
  // The palm does not move while the fingers do.
  const Vector3d unfolded =
      centroid(hand_shape(HandPose::open).fingertips_m) - centroid(hand_shape(with.pose).fingertips_m);
  const auto open_at = [&](Posture posture, double u) {
    posture.pose = HandPose::open;
    posture.centroid_m = path(u) + posture.tilt * unfolded;
    return posture;
  };
  Posture begin = with, end = with;
  end.tilt = last_tilt;
  begin.potentiometer = now_.potentiometer;
  begin.centroid_m = path(0.0);
  end.centroid_m = path(1.0);
  move_to(open_at(begin, 0.0));
  move_to(begin);
  Segment segment;
  segment.duration_s = duration_s;
  segment.from = begin;
  segment.to = end;
  segment.contact_pose = with.pose;
  segment.centroid_m = [path](double u) { return path(minimum_jerk(u)); };
  segment.pressure = [pressure = std::move(pressure)](double u) { return pressure(minimum_jerk(u)); };
  for (const double tap : thumb_taps) segment.taps_s.push_back(duration_s * time_of_way(tap));
  events_.push_back({kind, duration_s_, duration_s_ + duration_s, std::move(label)});
  append(std::move(segment));
  move_to(open_at(end, 1.0));
}

void HandProgram::push(std::string label, std::function<Vector3d(double)> path, double duration_s,
                       std::function<double(double)> pressure, double potentiometer,
                       const Quaterniond& tilt) {
  Posture closed;
  closed.pose = HandPose::closed;
  closed.tilt = tilt;
  closed.potentiometer = std::clamp(potentiometer, 0.0, 1.0);
  act(HandEvent::Kind::push, std::move(label), std::move(path), duration_s, std::move(pressure), closed,
      tilt);
}

void HandProgram::drag(std::string label, std::function<Vector3d(double)> path, double duration_s,
                       const Quaterniond& turn) {
  Posture closed;
  closed.pose = HandPose::closed;
  closed.potentiometer = now_.potentiometer;
  act(
      HandEvent::Kind::push, std::move(label), std::move(path), duration_s, [](double) { return 0.0; },
      closed, turn);
}

void HandProgram::draw(std::string label, std::function<Vector3d(double)> path, double duration_s,
                       std::function<double(double)> pressure, const Quaterniond& tilt,
                       const std::vector<double>& thumb_taps) {
  Posture pointing;
  pointing.pose = HandPose::pointing;
  pointing.tilt = tilt;
  pointing.potentiometer = now_.potentiometer;
  const FingerPoints tips = hand_shape(HandPose::pointing).fingertips_m;
  const Vector3d from_index = tilt * (centroid(tips) - tips[static_cast<std::size_t>(Finger::index)]);
  auto centroid_path = [path = std::move(path), from_index](double u) -> Vector3d {
    return path(u) + from_index;
  };
  act(HandEvent::Kind::draw, std::move(label), std::move(centroid_path), duration_s, std::move(pressure),
      pointing, tilt, thumb_taps);
}

void HandProgram::touch(PaletteCommand command) {
  const PaletteCell& cell = palette_cell_of(command);
  while (!is_on_page(cell, palette_page_)) touch(PaletteCommand::next_page);
  lie_down(cell);
  if (command == PaletteCommand::next_page) palette_page_ = palette_page_after(palette_page_);
}

void HandProgram::lie_down(const PaletteCell& cell) {
  Posture down;
  down.potentiometer = now_.potentiometer;
  down.centroid_m = Vector3d(cell.centre_x_m, cell.centre_y_m, options_.fingertip_rest_m);
  down.pose = HandPose::on_table;
  move_to(down);
  Segment segment;
  segment.duration_s = options_.touch_s;
  segment.from = segment.to = down;
  segment.contact_pose = HandPose::on_table;
  segment.centroid_m = [place = down.centroid_m](double) { return place; };
  events_.push_back(
      {HandEvent::Kind::touch, duration_s_, duration_s_ + options_.touch_s, std::string(cell.label)});
  append(std::move(segment));
  Posture up;
  up.potentiometer = now_.potentiometer;
  up.centroid_m = down.centroid_m + Vector3d(-0.02, 0.0, 0.06);
  move_to(up);
}

void HandProgram::gesture(HandPose pose, const Vector3d& centroid_m, double hold_s) {
  Posture posture;
  posture.potentiometer = now_.potentiometer;
  posture.centroid_m = centroid_m;
  posture.pose = pose;
  move_to(posture);
  idle(hold_s);
}

FingerPoints HandProgram::tremor_at(double time_s) const {
  // Two sines of 7..11 Hz per finger and axis (physiological tremor), less their mean over the fingers.
  constexpr int sines = 2;
  const double amplitude = options_.tremor_m;
  FingerPoints tremor;
  for (std::uint64_t finger = 0; finger < finger_count; ++finger) {
    for (std::uint64_t axis = 0; axis < 3; ++axis) {
      double sum = 0;
      for (std::uint64_t sine = 0; sine < sines; ++sine) {
        const std::uint64_t key = (finger * 3 + axis) * sines + sine;
        const double frequency_hz = 7.0 + 4.0 * uniform(options_.seed, key, 0);
        sum += std::sin(2 * pi * (frequency_hz * time_s + uniform(options_.seed, key, 1)));
      }
      tremor[finger][static_cast<Eigen::Index>(axis)] = amplitude * sum * std::sqrt(2.0 / sines);
    }
  }
  const Vector3d mean = centroid(tremor);
  // One axis of a 3D tremor of the given RMS; removing the mean of five takes a fifth of the variance.
  for (Vector3d& value : tremor) value = (value - mean) * std::sqrt(5.0 / 4.0 / 3.0);
  return tremor;
}

HandState HandProgram::at(double time_s) const {
  HandState state;
  state.potentiometer = now_.potentiometer;
  Vector3d place = now_.centroid_m;
  Quaterniond tilt = now_.tilt;
  HandShape shape = hand_shape(now_.pose);
  std::optional<FingerPoints> recorded;
  bool thumb_laid = false;
  state.pose = now_.pose;
  if (!segments_.empty()) {
    const double time = std::isfinite(time_s) ? std::clamp(time_s, 0.0, duration_s_) : 0.0;
    auto after = std::upper_bound(segments_.begin(), segments_.end(), time,
                                  [](double t, const auto& segment) { return t < segment->begin_s; });
    const Segment& segment = **(after == segments_.begin() ? after : after - 1);
    const double u =
        segment.duration_s > 0 ? std::clamp((time - segment.begin_s) / segment.duration_s, 0.0, 1.0) : 1.0;
    const double eased = minimum_jerk(u);
    place = segment.centroid_m(u);
    tilt = segment.from.tilt.slerp(eased, segment.to.tilt);
    shape = segment.from.pose == segment.to.pose
                ? hand_shape(segment.to.pose)
                : blend(hand_shape(segment.from.pose), hand_shape(segment.to.pose), eased);
    state.pose = u < segment.contact_from ? segment.contact_before : segment.contact_pose;
    state.potentiometer = (1 - eased) * segment.from.potentiometer + eased * segment.to.potentiometer;
    thumb_laid = std::any_of(segment.taps_s.begin(), segment.taps_s.end(), [&](double tap) {
      const double since = time - segment.begin_s - tap;
      return since >= 0 && since < options_.tap_s;
    });
    if (segment.fingertips_m) recorded = segment.fingertips_m(u);
    if (segment.pressure) state.pressure = std::clamp(segment.pressure(u), 0.0, 1.0);
  }
  state.contacts = contacts_of(state.pose);
  if (thumb_laid) state.contacts = static_cast<std::uint16_t>(state.contacts | contact_thumb);
  if (recorded) {
    state.world_from_palm = palm_of(*recorded);
    const Eigen::Isometry3d palm_from_world = state.world_from_palm.inverse();
    for (std::size_t i = 0; i < finger_count; ++i) {
      shape.middle_joints_m[i] += (palm_from_world * (*recorded)[i] - shape.fingertips_m[i]) / 2;
      shape.fingertips_m[i] = palm_from_world * (*recorded)[i];
    }
  } else {
    state.world_from_palm.linear() = tilt.toRotationMatrix();
    state.world_from_palm.translation() = place - tilt * centroid(shape.fingertips_m);
  }
  const FingerPoints tremor = tremor_at(time_s);
  for (std::size_t i = 0; i < finger_count; ++i) {
    state.fingertips_m[i] = state.world_from_palm * shape.fingertips_m[i] + tremor[i];
    state.middle_joints_m[i] = state.world_from_palm * shape.middle_joints_m[i];
    state.knuckles_m[i] = state.world_from_palm * shape.knuckles_m[i];
  }
  return state;
}

}  // namespace handloft::tracking
