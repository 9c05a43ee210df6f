#include "server-model/interaction/interaction.h"

#include <fmt/core.h>

#include <array>
#include <iterator>
#include <span>
#include <utility>

namespace handloft::interaction {
namespace {

void set_vec3(v1::Vec3& to, const Eigen::Vector3d& from) {
  to.set_x(from.x());
  to.set_y(from.y());
  to.set_z(from.z());
}

model::SymmetryMode shape_mode(StrokeSymmetry symmetry) {
  switch (symmetry) {
    case StrokeSymmetry::same_shape:
      return model::SymmetryMode::same_shape;
    case StrokeSymmetry::partner:
      return model::SymmetryMode::partner;
    case StrokeSymmetry::off:
      break;
  }
  return model::SymmetryMode::off;
}

v1::SetSymmetry symmetry_message(StrokeSymmetry symmetry, const model::MirrorPlane& plane) {
  v1::SetSymmetry message;
  switch (symmetry) {
    case StrokeSymmetry::off:
      message.set_mode(v1::SetSymmetry::OFF);
      return message;
    case StrokeSymmetry::same_shape:
      message.set_mode(v1::SetSymmetry::SAME_SHAPE);
      break;
    case StrokeSymmetry::partner:
      message.set_mode(v1::SetSymmetry::PARTNER);
      break;
  }
  set_vec3(*message.mutable_plane()->mutable_origin(), plane.origin);
  set_vec3(*message.mutable_plane()->mutable_normal(), plane.normal);
  return message;
}

std::string symmetry_words(StrokeSymmetry symmetry) {
  switch (symmetry) {
    case StrokeSymmetry::same_shape:
      return "symmetry: one shape";
    case StrokeSymmetry::partner:
      return "symmetry: partner shape";
    case StrokeSymmetry::off:
      break;
  }
  return "symmetry off";
}

/// What a viewer reads when a command was refused.
constexpr const char* refused_tool = "refused";

}  // namespace

Interaction::Interaction(model::Model& model, InteractionOptions options)
    : model_(model), options_(std::move(options)) {
  for (std::size_t i = 0; i < max_hands; ++i) {
    hands_.emplace_back(options_.centre);
  }
}

std::string Interaction::active_shape() const {
  return model_.document().find(active_) ? active_ : std::string();
}

void Interaction::select(std::string entity) {
  active_ = std::move(entity);
}

HandActivity Interaction::activity(std::size_t hand) const {
  return hand < hands_.size() ? hands_[hand].activity : HandActivity{};
}

FrameOutcome Interaction::on_frame(const v1::TrackingFrame& frame) {
  FrameOutcome outcome;
  ++statistics_.frames;
  const TimePoint now = from_ns(frame.capture_time_ns());
  if (last_frame_ && now < *last_frame_) {
    ++statistics_.frames_out_of_order;
  } else {
    // All or nothing: a frame with one bad number is not to be trusted in the others.
    std::array<std::optional<HandSample>, max_hands> samples;
    bool good = true;
    for (std::size_t i = 0; i < max_hands && good; ++i) {
      auto sample = read_hand(frame, static_cast<int>(i), options_.limits);
      if (sample) {
        samples[i] = *sample;
      } else {
        good = false;
        outcome.problems.push_back("tracking frame ignored: " + sample.error().describe());
      }
    }
    if (good) {
      last_frame_ = now;
      for (std::size_t i = 0; i < max_hands; ++i) on_hand(hands_[i], samples[i], now, outcome);
    } else {
      ++statistics_.frames_ignored;
    }
  }
  if (frame.end_of_recording()) {
    FrameOutcome last = finish();
    outcome.scene_changed |= last.scene_changed;
    std::move(last.submitted.begin(), last.submitted.end(), std::back_inserter(outcome.submitted));
    std::move(last.problems.begin(), last.problems.end(), std::back_inserter(outcome.problems));
  }
  return outcome;
}

FrameOutcome Interaction::finish() {
  FrameOutcome outcome;
  for (Hand& hand : hands_) {
    if (hand.stroke) commit_stroke(hand, outcome);
    hand = Hand(options_.centre);
  }
  last_frame_.reset();  // what comes next may be another recording
  return outcome;
}

void Interaction::on_hand(Hand& hand, const std::optional<HandSample>& sample, TimePoint now,
                          FrameOutcome& outcome) {
  if (!sample) {
    on_gap(hand, Gap::hand_lost, now, outcome);
    return;
  }
  const std::optional<Eigen::Vector3d> centre = hand.centre.update(*sample);
  if (sample->gesture == v1::GESTURE_UNKNOWN) {
    on_gap(hand, centre ? Gap::gesture_unknown : Gap::hand_lost, now, outcome);
    return;
  }
  if (sample->gesture != v1::GESTURE_ON_TABLE) hand.touch_spent = false;
  if (sample->gesture == v1::GESTURE_OPEN && sample->pressing) {
    if (!centre) {
      on_gap(hand, Gap::hand_lost, now, outcome);
      return;
    }
    hand.unusable_since.reset();
    if (!hand.refused) lay_point(hand, *centre, *sample, outcome);
    return;
  }

  // The glove says that the gesture is over, whether or not a camera sees the fingers.
  hand.unusable_since.reset();
  hand.refused = false;
  if (hand.stroke) commit_stroke(hand, outcome);
  if (sample->gesture != v1::GESTURE_ON_TABLE) {
    hand.activity = {};
    return;
  }
  if (hand.touch_spent) return;
  const std::optional<Eigen::Vector3d> over = centre ? centre : hand.centre.rough(*sample);
  if (!over) return;
  if (const auto command = palette_command_at(over->x(), over->y())) {
    hand.touch_spent = true;
    run_command(hand, *command, outcome);
  }
}

void Interaction::on_gap(Hand& hand, Gap gap, TimePoint now, FrameOutcome& outcome) {
  if (!hand.unusable_since) hand.unusable_since = now;
  if (now - *hand.unusable_since <= options_.grace) return;
  hand.refused = false;
  if (!hand.stroke) {
    hand.activity = {};
  } else if (gap == Gap::hand_lost) {
    cancel_stroke(hand, "the hand was lost", outcome);
    hand.activity = {"hand lost", {}};
  } else {
    commit_stroke(hand, outcome);
    hand.activity = {};
  }
}

void Interaction::lay_point(Hand& hand, const Eigen::Vector3d& position, const HandSample& sample,
                            FrameOutcome& outcome) {
  v1::Point point;
  set_vec3(*point.mutable_position(), position);
  point.set_pressure(sample.pressure);
  point.set_time_ns(to_ns(sample.capture_time));

  if (!hand.stroke) {
    v1::Operation operation = new_stroke();
    *operation.mutable_add_points()->add_points() = point;
    if (!begin_stroke(hand, std::move(operation), outcome)) return;
  } else {
    *hand.stroke->operation.mutable_add_points()->add_points() = point;
    if (!model_.append_provisional(hand.stroke->id, std::span(&point, 1))) {
      // Somebody else changed the base so that the stroke could not go on as it was: once more with all of
      // its points.
      model_.cancel_provisional(hand.stroke->id);
      v1::Operation operation = std::move(hand.stroke->operation);
      hand.stroke.reset();
      if (!begin_stroke(hand, std::move(operation), outcome)) {
        ++statistics_.strokes_cancelled;
        outcome.scene_changed = true;
        return;
      }
    }
  }
  ++statistics_.points_laid;
  outcome.scene_changed = true;
  hand.activity = {"laying points", hand.stroke->entity};
}

v1::Operation Interaction::new_stroke() const {
  v1::Operation operation;
  v1::AddPoints& add = *operation.mutable_add_points();
  add.set_min_spacing_m(options_.min_spacing_m);
  add.set_entity(active_shape());
  const model::DualPtr shape = model_.document().find_dual(add.entity());
  if (!shape) {
    add.mutable_create()->set_degree(options_.new_degree);
    if (symmetry_ != StrokeSymmetry::off)
      *add.mutable_symmetry() = symmetry_message(symmetry_, options_.symmetry_plane);
    return operation;
  }
  const bool same_plane = shape->plane.origin == options_.symmetry_plane.origin &&
                          shape->plane.normal == options_.symmetry_plane.normal;
  if (shape->symmetry != shape_mode(symmetry_) || (symmetry_ != StrokeSymmetry::off && !same_plane)) {
    *add.mutable_symmetry() = symmetry_message(symmetry_, options_.symmetry_plane);
  }
  return operation;
}

std::string Interaction::next_shape_id() const {
  // Also not one that another hand's stroke in the air is about to make.
  const auto taken = [&](const std::string& id) {
    if (model_.document().used_ids->contains(id)) return true;
    for (const Hand& hand : hands_) {
      if (hand.stroke && hand.stroke->entity == id) return true;
    }
    return false;
  };
  std::uint64_t number = model_.document().next_shape;
  std::string id;
  do {
    id = fmt::format("shape-{}", number++);
  } while (taken(id));  // used ids are bounded, so this ends
  return id;
}

bool Interaction::begin_stroke(Hand& hand, v1::Operation operation, FrameOutcome& outcome) {
  v1::AddPoints& add = *operation.mutable_add_points();
  if (add.has_create()) add.set_entity(next_shape_id());
  auto id = model_.begin_provisional(operation);
  if (!id) {
    ++statistics_.refused;
    hand.refused = true;  // until the next gesture: not a complaint for every frame
    hand.activity = {refused_tool, add.entity()};
    outcome.problems.push_back("stroke refused: " + id.error().describe());
    return false;
  }
  std::string entity = add.entity();
  hand.stroke = Stroke{*id, std::move(entity), std::move(operation)};
  return true;
}

void Interaction::commit_stroke(Hand& hand, FrameOutcome& outcome) {
  outcome.scene_changed = true;
  if (!model_.provisional(hand.stroke->id)) {  // the base changed beneath it since its last point
    v1::Operation operation = std::move(hand.stroke->operation);
    hand.stroke.reset();
    if (!begin_stroke(hand, std::move(operation), outcome)) {
      ++statistics_.strokes_cancelled;
      return;
    }
  }
  auto submitted = model_.commit_provisional(hand.stroke->id);
  if (submitted) {
    ++statistics_.strokes_committed;
    active_ = hand.stroke->entity;
    outcome.submitted.push_back(std::move(*submitted));
  } else {
    ++statistics_.refused;
    ++statistics_.strokes_cancelled;
    outcome.problems.push_back("stroke refused: " + submitted.error().describe());
  }
  hand.stroke.reset();
}

void Interaction::cancel_stroke(Hand& hand, std::string_view why, FrameOutcome& outcome) {
  model_.cancel_provisional(hand.stroke->id);
  outcome.problems.push_back(fmt::format("stroke on \"{}\" cancelled: {}", hand.stroke->entity, why));
  hand.stroke.reset();
  ++statistics_.strokes_cancelled;
  outcome.scene_changed = true;
}

bool Interaction::submit(const v1::Operation& operation, FrameOutcome& outcome) {
  auto submitted = model_.submit(operation);
  if (!submitted) {
    ++statistics_.refused;
    outcome.problems.push_back("command refused: " + submitted.error().describe());
    return false;
  }
  outcome.scene_changed = true;
  outcome.submitted.push_back(std::move(*submitted));
  return true;
}

// One step to undo. A linked partner is fitted and shown along with its shape by the operation itself (A12).
bool Interaction::submit_fit(FrameOutcome& outcome) {
  v1::Operation fit;
  fit.mutable_fit()->set_entity(active_shape());
  fit.mutable_fit()->set_show(v1::REPRESENTATION_SURFACE);
  return submit(fit, outcome);
}

bool Interaction::toggle_representation(FrameOutcome& outcome) {
  const model::DualPtr shape = model_.document().find_dual(active_shape());
  const bool points_only = !shape || shape->representation == model::Representation::points;
  return show(points_only ? model::Representation::surface : model::Representation::points, outcome);
}

bool Interaction::show(model::Representation representation, FrameOutcome& outcome) {
  const std::string entity = active_shape();
  const model::DualPtr shape = model_.document().find_dual(entity);
  if (shape && shape->representation == representation) return true;
  v1::Operation operation;
  operation.mutable_set_representation()->set_entity(entity);
  operation.mutable_set_representation()->set_representation(representation == model::Representation::surface
                                                                 ? v1::REPRESENTATION_SURFACE
                                                                 : v1::REPRESENTATION_POINTS);
  return submit(operation, outcome);
}

void Interaction::run_command(Hand& hand, PaletteCommand command, FrameOutcome& outcome) {
  ++statistics_.commands;
  v1::Operation operation;
  std::string words;
  bool done = true;
  switch (command) {
    case PaletteCommand::fit:
      words = "fit";
      done = submit_fit(outcome);
      break;
    case PaletteCommand::representation:
      words = "points / surface";
      done = toggle_representation(outcome);
      break;
    case PaletteCommand::new_shape:
      words = "new shape";
      active_.clear();
      outcome.scene_changed = true;
      break;
    case PaletteCommand::symmetry:
      symmetry_ = symmetry_ == StrokeSymmetry::off          ? StrokeSymmetry::same_shape
                  : symmetry_ == StrokeSymmetry::same_shape ? StrokeSymmetry::partner
                                                            : StrokeSymmetry::off;
      words = symmetry_words(symmetry_);
      break;
    case PaletteCommand::undo:
      words = "undo";
      operation.mutable_undo();
      done = submit(operation, outcome);
      break;
    case PaletteCommand::redo:
      words = "redo";
      operation.mutable_redo();
      done = submit(operation, outcome);
      break;
  }
  hand.activity = {done ? words : words + ": " + refused_tool, active_shape()};
}

}  // namespace handloft::interaction
