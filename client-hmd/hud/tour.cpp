#include "client-hmd/hud/tour.h"

#include <algorithm>
#include <array>

namespace handloft::client {
namespace {

/// Enough for a fit of degree 2, which has six unknowns, to be more than exact (A4, A7).
constexpr std::size_t points_of_a_stroke = 12;

constexpr std::array<TourText, tour_steps> texts{{
    {"Lay some points", "Choose Lay points, then hold the left button and paint a patch over the table.",
     "Points are soft evidence: the harder you press, the surer they are.", "Hold and paint a patch"},
    {"Fit a surface", "Press Fit.", "The surface goes where your points want it to be, and it stays smooth.",
     "Now press Fit"},
    {"Push it into shape", "Show the surface, choose Push, and drag against it.",
     "Your push moves the points, and the surface follows them.", "Drag against the surface"},
    {"Trim it", "Choose Trim and draw a closed line on the surface.", "What is outside of the line goes.",
     "Draw a closed line"},
    {"Export it", "Press Export to write a STEP file, or Undo to take a step back.",
     "Everything can be undone, and the file opens in any CAD program.", "Export, or try Undo"},
}};

bool begins_with_any(std::string_view words, std::initializer_list<std::string_view> beginnings) {
  return std::any_of(beginnings.begin(), beginnings.end(),
                     [words](std::string_view beginning) { return words.starts_with(beginning); });
}

/// What undo would take back is another step than before.
bool stepped(const TourSight& before, const TourSight& now) {
  return now.undo_steps != before.undo_steps || now.last_step != before.last_step;
}

bool done(TourStep step, const TourSight& before, const TourSight& now) {
  switch (step) {
    case TourStep::lay:
      return now.points >= before.points + points_of_a_stroke;
    case TourStep::fit:
      return now.surfaces > before.surfaces ||
             (stepped(before, now) && now.surfaces > 0 && begins_with_any(now.last_step, {"Fit"}));
    case TourStep::push:
      return now.surface_shown && stepped(before, now) &&
             begins_with_any(now.last_step, {"Push", "Move ", "Drag icon"});
    case TourStep::trim:
      return now.boundaries > before.boundaries ||
             (stepped(before, now) && begins_with_any(now.last_step, {"Trim"}));
    case TourStep::finish:
      return now.exports > before.exports || now.redo_steps > before.redo_steps;
  }
  return false;
}

}  // namespace

TourSight tour_sight(const Scene& scene, std::uint64_t exports) {
  TourSight sight;
  sight.exports = exports;
  sight.undo_steps = scene.history.undo_steps;
  sight.redo_steps = scene.history.redo_steps;
  sight.last_step = scene.history.next_undo;
  for (const auto& [id, entity] : scene.entities) {
    if (entity->kind == EntityKind::reference || entity->kind == EntityKind::cad_model) continue;
    if (entity->points != nullptr) {
      sight.points += entity->provisional
                          ? std::min<std::size_t>(entity->settled_points, entity->points->points.size())
                          : entity->points->points.size();
    }
    if (entity->surface != nullptr) ++sight.surfaces;
    sight.surface_shown = sight.surface_shown || entity->shows_surface();
    if (entity->curves == nullptr) continue;
    for (const SceneCurve& curve : *entity->curves) {
      if (curve.kind == CurveKind::boundary && curve.closed) ++sight.boundaries;
    }
  }
  return sight;
}

const TourText& tour_text(TourStep step) {
  return texts[std::min(static_cast<std::size_t>(step), texts.size() - 1)];
}

Tour::Tour(const HudSettings& settings)
    : state_(settings.tour_done ? State::ended : State::waiting),
      step_(std::clamp(settings.tour_step, 0, tour_steps - 1)) {}

void Tour::look(const TourSight& sight) {
  if (state_ == State::waiting) state_ = State::running;
  if (state_ != State::running) return;
  if (!entered_) {
    before_ = sight;
    entered_ = true;
    return;
  }
  if (done(step(), before_, sight)) {
    advance();
    before_ = sight;
    entered_ = state_ == State::running;
    return;
  }
  // Undone or deleted meanwhile: what comes back counts as new.
  before_.points = std::min(before_.points, sight.points);
  before_.surfaces = std::min(before_.surfaces, sight.surfaces);
  before_.boundaries = std::min(before_.boundaries, sight.boundaries);
  before_.redo_steps = std::min(before_.redo_steps, sight.redo_steps);
}

void Tour::advance() {
  entered_ = false;
  if (++step_ < tour_steps) return;
  step_ = 0;
  state_ = State::finished;
}

void Tour::skip_step() {
  if (state_ == State::running) advance();
}

void Tour::end() {
  state_ = State::ended;
  step_ = 0;
  entered_ = false;
}

void Tour::repeat() {
  state_ = State::waiting;
  step_ = 0;
  entered_ = false;
}

void Tour::dismiss() {
  if (state_ == State::finished) state_ = State::ended;
}

void Tour::remember(HudSettings& settings) const {
  settings.tour_done = state_ == State::finished || state_ == State::ended;
  settings.tour_step = step_;
}

}  // namespace handloft::client
