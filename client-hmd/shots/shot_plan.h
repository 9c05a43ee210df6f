#pragma once
// A sequence of pictures (V8): a turntable, or what a script says. A plan is made before the scene is known;
// what it leaves to the scene (the middle of everything, a distance from which all is seen) is settled when
// the sequence begins.

#include <cstddef>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "client-hmd/mirror/scene.h"
#include "client-hmd/render/look.h"
#include "client-hmd/shots/camera_path.h"
#include "common/base/result.h"

namespace handloft::client {

/// "scene" in a script: the middle of the box about everything that is shown.
struct SceneCentre {};
using Target = std::variant<SceneCentre, glm::dvec3>;

/// Angles and a distance about the target; absent: from where all is seen, all the way round.
struct OrbitPlace {
  double azimuth_rad = 0.0;
  double elevation_rad = 0.0;
  std::optional<double> distance_m;
};

struct PlannedKey {
  double time_s = 0.0;
  Target target;
  std::variant<OrbitPlace, glm::dvec3> place;  ///< Or the eye itself, world, metres.
  double fov_y_rad = OrbitCamera().fov_y_rad;
};

/// From `time_s` on; what is absent stays as it was.
struct PlannedChange {
  double time_s = 0.0;
  std::optional<Representation> show;  ///< Of all shapes.
  std::optional<Shading> shading;
};

enum class ShotBackground { studio, transparent };
enum class ShotEyes { one, side_by_side };

struct ShotPlan {
  int width_px = 1280;
  int height_px = 720;
  double rate_hz = 30.0;
  int supersampling = 2;
  Easing easing = Easing::smooth;
  CameraPath::Ends ends = CameraPath::Ends::open;
  ShotBackground background = ShotBackground::studio;
  ShotEyes eyes = ShotEyes::one;
  double eye_distance_m = 0.063;  ///< Between the pupils of an adult, median (ANSUR II, 2012).
  std::vector<PlannedKey> keys;
  std::vector<PlannedChange> changes;

  /// Pictures in all: of a loop, the last one is a step before the first.
  std::size_t frames() const;
};

struct TurntableOptions {
  int frames = 120;                  ///< Four seconds at 30 a second.
  double elevation_rad = 0.44;       ///< 25 degrees: tops and sides of things on a table.
  std::optional<double> distance_m;  ///< Absent: as near as all of the scene allows.
};

/// Once round the scene's middle at constant speed, ready to be repeated without a jump.
ShotPlan turntable_plan(const TurntableOptions& options);

/// What one picture of a settled plan shows.
struct ShotView {
  OrbitCamera camera;
  std::optional<Representation> show;
  std::optional<Shading> shading;
};

/// A plan for one scene.
class Shot {
 public:
  /// Errors: failed_precondition when the plan needs the scene's middle and nothing is shown.
  static Result<Shot> settle(const ShotPlan& plan, const std::vector<glm::dvec3>& visible_places);

  std::size_t frames() const { return frames_; }
  /// Of picture `index`, from 0.
  ShotView view(std::size_t index) const;

 private:
  Shot(CameraPath path, const ShotPlan& plan);
  CameraPath path_;
  std::vector<PlannedChange> changes_;
  double rate_hz_;
  std::size_t frames_;
};

/// The nearest distance at which a camera that turns about `centre` at one elevation has all of the places in
/// its picture, all the way round, with the margins of OrbitCamera::fit(). At least 5 cm before the foremost.
double turning_distance_m(const std::vector<glm::dvec3>& places, const glm::dvec3& centre,
                          double elevation_rad, double fov_y_rad, double width_by_height);

/// The scene with every shape shown as `representation`, where it has what that needs.
std::shared_ptr<const Scene> shown_as(const std::shared_ptr<const Scene>& scene,
                                      Representation representation);

}  // namespace handloft::client
