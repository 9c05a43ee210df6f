#pragma once
// The first run's guided tour (V6, V7): five steps from an empty table to an exported shape, each of which is
// done when the scene shows that it is. Pure: what is seen in, where the tour stands out.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "client-hmd/hud/settings.h"
#include "client-hmd/mirror/scene.h"

namespace handloft::client {

enum class TourStep { lay, fit, push, trim, finish };

/// What the tour looks at.
struct TourSight {
  std::size_t points = 0;  ///< Of all shapes, without those of a gesture in the air.
  std::size_t surfaces = 0;
  std::size_t boundaries = 0;  ///< Closed curves that trim.
  bool surface_shown = false;  ///< Some shape shows its surface.
  std::uint32_t undo_steps = 0;
  std::uint32_t redo_steps = 0;
  std::string last_step;      ///< What undo would take back, in the server's words.
  std::uint64_t exports = 0;  ///< Files written since the start, as their acknowledgements told.
};

/// `exports`: since the program began.
TourSight tour_sight(const Scene& scene, std::uint64_t exports);

struct TourText {
  std::string_view title;
  std::string_view task;  ///< What to do.
  std::string_view why;   ///< What it is good for.
  std::string_view hint;  ///< A few words, beside the cursor.
};

/// Of a step.
const TourText& tour_text(TourStep step);

class Tour {
 public:
  enum class State {
    waiting,  ///< For the first picture of the scene.
    running,
    finished,  ///< All steps done.
    ended,     ///< Skipped, or not wanted.
  };

  /// As the settings remember it.
  explicit Tour(const HudSettings& settings);

  /// Once a frame while the model server is there: begins, and goes on when the present step is done.
  void look(const TourSight& sight);
  /// The present step as if it were done.
  void skip_step();
  /// Not again by itself.
  void end();
  /// From the first step.
  void repeat();
  /// Puts away the words that say it is finished.
  void dismiss();

  State state() const { return state_; }
  TourStep step() const { return static_cast<TourStep>(step_); }
  int step_number() const { return step_; }  ///< From 0.
  /// What the settings shall remember.
  void remember(HudSettings& settings) const;

 private:
  void advance();

  State state_ = State::waiting;
  int step_ = 0;
  bool entered_ = false;  ///< `before_` is of the present step.
  TourSight before_;
};

}  // namespace handloft::client
