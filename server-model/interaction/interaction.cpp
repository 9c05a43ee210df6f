#include "server-model/interaction/interaction.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <utility>

#include "server-model/interaction/boundary_gesture.h"
#include "server-model/interaction/exponent_gesture.h"
#include "server-model/interaction/icon_drag_gesture.h"
#include "server-model/interaction/icon_pen_gesture.h"
#include "server-model/interaction/pointing.h"
#include "server-model/interaction/profile_gesture.h"
#include "server-model/interaction/push_gesture.h"
#include "server-model/interaction/stroke_gesture.h"
#include "server-model/interaction/transform_gesture.h"

namespace handloft::interaction {
namespace {

/// What a viewer reads when something was refused.
std::string refusal(std::string_view what, std::string_view why) {
  return why.empty() ? fmt::format("{}: refused", what) : fmt::format("{}: refused: {}", what, why);
}

}  // namespace

InteractionStatistics& InteractionStatistics::operator+=(const InteractionStatistics& other) {
  frames += other.frames;
  frames_ignored += other.frames_ignored;
  frames_out_of_order += other.frames_out_of_order;
  points_laid += other.points_laid;
  strokes_committed += other.strokes_committed;
  strokes_cancelled += other.strokes_cancelled;
  gestures_committed += other.gestures_committed;
  gestures_cancelled += other.gestures_cancelled;
  commands += other.commands;
  refused += other.refused;
  return *this;
}

Interaction::Interaction(model::Model& model, const InteractionOptions& options)
    : Interaction(model, options, std::make_shared<Claims>(), 0) {}

Interaction::Interaction(model::Model& model, const InteractionOptions& options, ClaimsPtr claims,
                         std::uint64_t client_id)
    : workbench_(model, options, std::move(claims), client_id),
      palette_(workbench_),
      space_mouse_(workbench_) {
  for (std::size_t i = 0; i < max_hands; ++i) hands_.emplace_back(workbench_.options);
}

void Interaction::select(std::string entity) {
  if (entity.empty()) workbench_.active.clear();
  if (workbench_.picked_icon.entity != entity) workbench_.picked_icon = IconName();
  workbench_.selected = std::move(entity);
}

bool Interaction::lapse() {
  for (const IconName& name : workbench_.held) workbench_.claims->icons.erase(name);
  return !std::exchange(workbench_.held, {}).empty();
}

std::vector<std::string> Interaction::selection() const {
  std::string active = active_shape();
  return active.empty() ? std::vector<std::string>() : std::vector<std::string>{std::move(active)};
}

std::vector<std::string> Interaction::targets() const {
  std::vector<std::string> targets;
  for (const Hand& hand : hands_) {
    if (!hand.target.empty()) targets.push_back(hand.target);
  }
  std::sort(targets.begin(), targets.end());
  targets.erase(std::unique(targets.begin(), targets.end()), targets.end());
  return targets;
}

std::vector<IconMark> Interaction::icon_marks() const {
  std::vector<IconMark> marks;
  for (const IconName& name : workbench_.held) marks.push_back({name, IconMark::Kind::held});
  for (const Hand& hand : hands_) {
    if (!hand.near_icon || workbench_.claims->icons.contains(hand.near_icon->name)) continue;
    const bool told = std::any_of(marks.begin(), marks.end(),
                                  [&](const IconMark& mark) { return mark.name == hand.near_icon->name; });
    if (!told) marks.push_back({hand.near_icon->name, IconMark::Kind::target});
  }
  std::sort(marks.begin(), marks.end(), [](const IconMark& a, const IconMark& b) { return a.name < b.name; });
  return marks;
}

Interaction::Felt Interaction::felt() const {
  const bool refusing = std::any_of(hands_.begin(), hands_.end(), [](const Hand& hand) {
    return hand.gesture && hand.gesture->refusing();
  });
  return {workbench_.held, workbench_.picked_icon, statistics_.refused, refusing};
}

// A refusal is the more important news, and two pulses at once would be one.
void Interaction::feel(const Felt& before, FrameOutcome& outcome) const {
  const Felt now = felt();
  const bool taken = !std::ranges::includes(before.held, now.held);
  const bool selected = now.selected != before.selected && !now.selected.empty();
  if (now.refused > before.refused || (now.refusing && !before.refusing)) {
    outcome.pulses.push_back(Pulse::refused);
  } else if (taken || selected) {
    outcome.pulses.push_back(Pulse::picked);
  } else if (!std::ranges::includes(now.held, before.held)) {
    outcome.pulses.push_back(Pulse::released);
  }
}

void Interaction::count(const SpaceMouse::Counts& counts) {
  statistics_.gestures_committed += static_cast<std::uint64_t>(counts.committed);
  statistics_.gestures_cancelled += static_cast<std::uint64_t>(counts.refused);
  statistics_.refused += static_cast<std::uint64_t>(counts.refused);
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
      auto sample = read_hand(frame, static_cast<int>(i), workbench_.options.limits);
      if (sample) {
        samples[i] = *sample;
      } else {
        good = false;
        outcome.problems.push_back("tracking frame ignored: " + sample.error().describe());
      }
    }
    auto mouse = read_space_mouse(frame, workbench_.options.space_mouse);
    if (good && !mouse) {
      good = false;
      outcome.problems.push_back("tracking frame ignored: " + mouse.error().describe());
    }
    if (good) {
      last_frame_ = now;
      const Felt before = felt();
      for (std::size_t i = 0; i < max_hands; ++i) on_hand(hands_[i], samples[i], now, outcome);
      feel(before, outcome);
      count(space_mouse_.on_frame(*mouse, now, outcome));
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
    commit(hand, outcome);
    outcome.scene_changed |= !hand.target.empty() || hand.near_icon;
    hand = Hand(workbench_.options);
  }
  count(space_mouse_.finish(outcome));
  last_frame_.reset();  // what comes next may be another recording
  return outcome;
}

Interaction::Doing Interaction::wanted(Hand& hand, const HandFrame& frame) {
  switch (frame.sample.gesture) {
    case v1::GESTURE_OPEN:
      return frame.sample.pressing ? Doing::stroke : Doing::nothing;
    case v1::GESTURE_CLOSED:
      return wanted_closed(hand, frame);
    case v1::GESTURE_POINTING:
      return wanted_pointing(hand, frame);
    case v1::GESTURE_ON_TABLE:
      return hand.gesture && hand.doing == Doing::exponent ? Doing::exponent : Doing::nothing;
    default:
      return Doing::nothing;
  }
}

// A gesture goes on as it began, also when the other hand switches the mode meanwhile. A push that has met no
// shape yet becomes a drag when the fist comes to an icon.
Interaction::Doing Interaction::wanted_closed(Hand& hand, const HandFrame& frame) {
  if (hand.gesture && (hand.doing == Doing::drag_icon || hand.doing == Doing::hold_by_fist))
    return hand.doing;
  const bool pushing = hand.gesture && hand.doing == Doing::push;
  if (pushing && hand.gesture->begun()) return hand.doing;
  if (!pushing && workbench_.modes.tool == HandTool::move) return Doing::hold_by_fist;
  if (frame.fist_centre) {
    // What was highlighted is what is picked, though closing the hand has moved the fingertips.
    const model::Document& document = workbench_.model.document();
    std::optional<NearIcon> picked;
    if (hand.near_icon && !workbench_.claims->icons.contains(hand.near_icon->name)) {
      picked = workbench_.icons.within_reach(document, hand.near_icon->name, *frame.fist_centre);
    }
    if (!picked) picked = workbench_.icons.nearest(document, *frame.fist_centre, workbench_.claims->icons);
    if (picked) {
      hand.near_icon = std::move(picked);
      return Doing::drag_icon;
    }
  }
  return Doing::push;
}

// What is drawn on is settled by where the fingertip comes down.
Interaction::Doing Interaction::wanted_pointing(const Hand& hand, const HandFrame& frame) {
  if (hand.gesture && hand.doing == Doing::hold_by_fingertip) return hand.doing;
  const bool pen = hand.doing == Doing::profile || hand.doing == Doing::boundary;
  if (hand.gesture && pen && (hand.gesture->begun() || hand.pressed)) return hand.doing;
  if (hand.gesture && hand.doing == Doing::draw_icon &&
      static_cast<const IconPenGesture&>(*hand.gesture).busy()) {
    return hand.doing;
  }
  // Without a shape to be near to, a pen that was taken up stays the same.
  if (!(hand.gesture && pen) && workbench_.modes.tool == HandTool::move) return Doing::hold_by_fingertip;
  const auto tip = pen_tip(frame.sample);
  if (tip && points_at_sculpted(*tip)) return Doing::draw_icon;
  if (hand.gesture && pen) return hand.doing;
  return workbench_.modes.trim == TrimMode::profile ? Doing::profile : Doing::boundary;
}

// The selected shape when there is one, else the nearest within reach.
bool Interaction::points_at_sculpted(const Eigen::Vector3d& tip) {
  const model::Document& document = workbench_.model.document();
  const std::string selected = workbench_.selected_shape();
  if (!selected.empty()) return model::as_sculpt(document.find(selected)) != nullptr;
  const auto sculpted = workbench_.icons.nearest_surface(document, tip);
  if (!sculpted) return false;
  const auto other = workbench_.targets.nearest(document, tip, tip);
  return !other || sculpted->distance_m < other->distance_m;
}

std::unique_ptr<Gesture> Interaction::begin(Doing doing, const Hand& hand) {
  switch (doing) {
    case Doing::stroke:
      return std::make_unique<StrokeGesture>(workbench_);
    case Doing::push:
      return std::make_unique<PushGesture>(workbench_);
    case Doing::profile:
      return std::make_unique<ProfileGesture>(workbench_);
    case Doing::boundary:
      return std::make_unique<BoundaryGesture>(workbench_);
    case Doing::hold_by_fist:
      return std::make_unique<TransformGesture>(workbench_, TransformGesture::Grip::fist);
    case Doing::hold_by_fingertip:
      return std::make_unique<TransformGesture>(workbench_, TransformGesture::Grip::fingertip);
    case Doing::exponent:
      return std::make_unique<ExponentGesture>(workbench_);
    case Doing::drag_icon:
      return std::make_unique<IconDragGesture>(workbench_, *hand.near_icon);
    case Doing::draw_icon:
      return std::make_unique<IconPenGesture>(workbench_);
    case Doing::nothing:
      break;
  }
  return nullptr;
}

void Interaction::on_hand(Hand& hand, const std::optional<HandSample>& sample, TimePoint now,
                          FrameOutcome& outcome) {
  if (!sample) {
    on_gap(hand, Gap::hand_lost, now, outcome);
    return;
  }
  HandFrame frame{*sample, hand.centre.update(*sample), hand.fist.update(*sample)};
  if (!frame.fist_centre) frame.fist_centre = hand.centre.rough(*sample);
  if (sample->gesture != v1::GESTURE_ON_TABLE) hand.touch_spent = false;
  if (sample->gesture == v1::GESTURE_UNKNOWN) {
    if (hand.gesture) hand.gesture->let_go(sample->gesture_since);
    on_gap(hand, frame.centre ? Gap::gesture_unknown : Gap::hand_lost, now, outcome);
    return;
  }
  const Doing next = wanted(hand, frame);
  if (hand.gesture && hand.doing != next) {
    // The glove says that the gesture is over, whether or not a camera sees the fingers.
    hand.gesture->let_go(sample->gesture_since);
    commit(hand, outcome);
  }
  if (hand.refused != next) hand.refused = Doing::nothing;
  if (next != Doing::nothing && hand.refused == Doing::nothing) {
    if (!hand.gesture) {
      hand.gesture = begin(next, hand);
      hand.doing = next;
    }
    show_to(hand, frame, now, outcome);
  } else {
    hand.unusable_since.reset();
    if (sample->gesture == v1::GESTURE_ON_TABLE) {
      on_table(hand, frame, outcome);
    } else if (next == Doing::nothing) {
      be_silent(hand, now);
    }
  }
  hand.pressed = sample->pressing;
  aim_at_icon(hand, frame, outcome);
  aim(hand, frame, outcome);
}

void Interaction::show_to(Hand& hand, const HandFrame& frame, TimePoint now, FrameOutcome& outcome) {
  const auto preview = hand.gesture->on_frame(frame);
  if (!preview) {
    refuse(hand, preview.error(), outcome);
    return;
  }
  if (*preview == Preview::unseen) {
    on_gap(hand, Gap::hand_lost, now, outcome);
    return;
  }
  hand.unusable_since.reset();
  outcome.scene_changed |= *preview == Preview::changed;
  if (hand.doing == Doing::stroke) ++statistics_.points_laid;
  hand.told_until.reset();
  hand.activity = hand.gesture->activity();
  if (hand.gesture->done()) commit(hand, outcome);
}

void Interaction::on_table(Hand& hand, const HandFrame& frame, FrameOutcome& outcome) {
  if (hand.touch_spent) return;
  const auto over = frame.centre ? frame.centre : hand.centre.rough(frame.sample);
  if (!over) return;
  const auto command = palette_command_at(over->x(), over->y(), workbench_.modes.palette_page);
  if (!command) return;
  hand.touch_spent = true;
  ++statistics_.commands;
  if (*command == PaletteCommand::exponent) {
    hand.gesture = begin(Doing::exponent, hand);
    hand.doing = Doing::exponent;
    show_to(hand, frame, frame.sample.capture_time, outcome);
    return;
  }
  const CommandAnswer answer = palette_.run(*command, outcome);
  if (!answer.refusal.empty()) ++statistics_.refused;
  hand.activity = {
      answer.refusal.empty() ? answer.words : refusal(answer.words, answer.refusal), active_shape(), {}, {}};
}

CommandAnswer Interaction::command(std::size_t index, PaletteCommand command, FrameOutcome& outcome) {
  Hand& hand = hands_.at(index);
  ++statistics_.commands;
  const Felt before = felt();
  CommandAnswer answer =
      command == PaletteCommand::exponent ? step_exponent(outcome) : palette_.run(command, outcome);
  if (!answer.refusal.empty()) ++statistics_.refused;
  tell(hand, answer.refusal.empty() ? answer.words : refusal(answer.words, answer.refusal), active_shape(),
       last_frame_.value_or(TimePoint{}));
  feel(before, outcome);
  return answer;
}

// The potentiometer stands still between a touch and leaving at once, so where it stands does not matter.
CommandAnswer Interaction::step_exponent(FrameOutcome& outcome) {
  ExponentGesture gesture(workbench_);
  const auto refused = [&](const Error& error) {
    outcome.problems.push_back("command refused: " + error.describe());
    return CommandAnswer{std::string(gesture.name()), error.message, error.code};
  };
  if (const auto preview = gesture.on_frame({}); !preview) return refused(preview.error());
  std::string words = gesture.activity().tool;
  auto submitted = gesture.commit();
  if (!submitted) return refused(submitted.error());
  outcome.scene_changed = true;
  if (*submitted) outcome.submitted.push_back(**std::move(submitted));
  return {std::move(words), {}};
}

void Interaction::on_gap(Hand& hand, Gap gap, TimePoint now, FrameOutcome& outcome) {
  if (!hand.unusable_since) hand.unusable_since = now;
  if (now - *hand.unusable_since <= workbench_.options.grace) return;
  hand.refused = Doing::nothing;
  hand.last_place.reset();
  hand.pressed = false;
  if (!std::exchange(hand.target, {}).empty()) outcome.scene_changed = true;
  if (std::exchange(hand.near_icon, std::nullopt)) outcome.scene_changed = true;
  if (!hand.gesture || !hand.gesture->begun()) {
    hand.gesture.reset();
    be_silent(hand, now);
  } else if (gap == Gap::hand_lost) {
    cancel(hand, "the hand was lost", outcome);
    tell(hand, "hand lost", {}, now);
  } else {
    commit(hand, outcome);
  }
}

void Interaction::commit(Hand& hand, FrameOutcome& outcome) {
  if (!hand.gesture) return;
  const std::unique_ptr<Gesture> gesture = std::move(hand.gesture);
  hand.activity = {};
  if (!gesture->begun()) return;
  outcome.scene_changed = true;
  auto submitted = gesture->commit();
  if (!submitted) {
    ++statistics_.refused;
    ++statistics_.gestures_cancelled;
    if (hand.doing == Doing::stroke) ++statistics_.strokes_cancelled;
    outcome.problems.push_back(fmt::format("{} refused: {}", gesture->name(), submitted.error().describe()));
    if (last_frame_)
      tell(hand, refusal(gesture->name(), submitted.error().message), gesture->activity().entity,
           *last_frame_);
    return;
  }
  if (!*submitted) return;
  ++statistics_.gestures_committed;
  if (hand.doing == Doing::stroke) ++statistics_.strokes_committed;
  outcome.submitted.push_back(**std::move(submitted));
}

void Interaction::cancel(Hand& hand, std::string_view why, FrameOutcome& outcome) {
  hand.gesture->cancel();
  outcome.problems.push_back(
      fmt::format("{} on \"{}\" cancelled: {}", hand.gesture->name(), hand.gesture->activity().entity, why));
  hand.gesture.reset();
  ++statistics_.gestures_cancelled;
  if (hand.doing == Doing::stroke) ++statistics_.strokes_cancelled;
  outcome.scene_changed = true;
}

// Until the hand does something else: not a complaint for every frame.
void Interaction::refuse(Hand& hand, const Error& error, FrameOutcome& outcome) {
  outcome.problems.push_back(fmt::format("{} refused: {}", hand.gesture->name(), error.describe()));
  outcome.scene_changed |= hand.gesture->begun();
  ++statistics_.refused;
  if (hand.gesture->begun()) {
    ++statistics_.gestures_cancelled;
    if (hand.doing == Doing::stroke) ++statistics_.strokes_cancelled;
  }
  hand.activity = {refusal(hand.gesture->name(), error.message), hand.gesture->activity().entity, {}, {}};
  hand.gesture->cancel();
  hand.gesture.reset();
  hand.refused = hand.doing;
  hand.unusable_since.reset();
}

void Interaction::tell(Hand& hand, std::string words, std::string entity, TimePoint now) {
  hand.activity = {std::move(words), std::move(entity), {}, {}};
  hand.told_until = now + workbench_.options.tell_for;
}

void Interaction::be_silent(Hand& hand, TimePoint now) {
  if (hand.told_until && now < *hand.told_until) return;
  hand.told_until.reset();
  hand.activity = {};
}

// What a fist would pick here, or with the fingertip a tap; with "Move" on hands pick no icons.
void Interaction::aim_at_icon(Hand& hand, const HandFrame& frame, FrameOutcome& outcome) {
  if (hand.gesture && hand.doing == Doing::drag_icon) return;
  std::optional<NearIcon> near;
  const bool free = !hand.gesture || !hand.gesture->begun();
  const bool open = frame.sample.gesture == v1::GESTURE_OPEN;
  const bool pointing = frame.sample.gesture == v1::GESTURE_POINTING;
  const auto at = pointing ? pen_tip(frame.sample) : frame.fist_centre;
  if (free && (open || pointing) && at && workbench_.modes.tool == HandTool::sculpt) {
    near = workbench_.icons.nearest(workbench_.model.document(), *at, workbench_.claims->icons);
  }
  const bool same =
      hand.near_icon.has_value() == near.has_value() && (!near || hand.near_icon->name == near->name);
  hand.near_icon = std::move(near);
  if (!same) outcome.scene_changed = true;
}

void Interaction::aim(Hand& hand, const HandFrame& frame, FrameOutcome& outcome) {
  std::string target;
  const auto place = std::exchange(hand.last_place, frame.fist_centre);
  if (hand.gesture) target = hand.gesture->activity().entity;
  if (target.empty() && frame.fist_centre && frame.sample.gesture != v1::GESTURE_ON_TABLE) {
    target = hand.near_icon ? hand.near_icon->name.entity : workbench_.selected_shape();
    if (target.empty()) {
      target = workbench_.nearest_entity(place.value_or(*frame.fist_centre), *frame.fist_centre);
    }
  }
  if (target == hand.target) return;
  hand.target = std::move(target);
  outcome.scene_changed = true;
}

}  // namespace handloft::interaction
