#pragma once
// Takes a sequence of pictures of the scene as it is (V8): waits until it is there and still, then draws the
// pictures of a plan one after another, each into a file of its own.

#include <functional>
#include <iosfwd>

#include "client-hmd/main/feeds.h"
#include "client-hmd/main/options.h"
#include "client-hmd/render/renderer.h"
#include "client-hmd/shots/shot_plan.h"

namespace handloft::client {

/// What the options ask for. Errors: those of a script that cannot be read.
Result<ShotPlan> plan_of(const HmdOptions& options);

/// One picture of a plan, of the plan's size (twice as wide for two eyes). Errors: of drawing.
Result<Image> draw_shot(Renderer& renderer, const ShotPlan& plan, const ShotView& view, Frame frame);

struct ShootParts {
  const HmdOptions& options;
  const Clock& clock;
  Feeds& feeds;
  std::ostream& out;  ///< Told in the end where the pictures are, and how to make a video of them.
};

/// Precondition: a current OpenGL context. `interrupted` ends it early, which is an error. Errors: timeout
/// when no scene came; cancelled; of the plan, of drawing and of the files.
Status shoot(const ShootParts& parts, const std::function<bool()>& interrupted, const Logger& log);

}  // namespace handloft::client
