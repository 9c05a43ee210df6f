#include "client-hmd/shots/shot_plan.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>

namespace handloft::client {
namespace {

/// As fit()'s, but without room for the HUD, which no sequence shows.
constexpr double margin = 0.06;
constexpr double nearest_m = 0.05;

}  // namespace

std::size_t ShotPlan::frames() const {
  const double steps = keys.empty() ? 0.0 : keys.back().time_s * rate_hz;
  const auto whole = static_cast<std::size_t>(std::llround(steps));
  return ends == CameraPath::Ends::loop ? std::max<std::size_t>(whole, 1) : whole + 1;
}

ShotPlan turntable_plan(const TurntableOptions& options) {
  ShotPlan plan;
  plan.easing = Easing::linear;
  plan.ends = CameraPath::Ends::loop;
  const OrbitCamera standard;  // Begins where the window's view begins: at the designer's side.
  for (const double turns : {0.0, 1.0}) {
    PlannedKey key;
    key.time_s = turns * options.frames / plan.rate_hz;
    key.place = OrbitPlace{standard.azimuth_rad + turns * glm::two_pi<double>(), options.elevation_rad,
                           options.distance_m};
    plan.keys.push_back(key);
  }
  return plan;
}

double turning_distance_m(const std::vector<glm::dvec3>& places, const glm::dvec3& centre,
                          double elevation_rad, double fov_y_rad, double width_by_height) {
  const double ty = std::tan(fov_y_rad / 2.0) * (1.0 - 2.0 * margin);
  const double tx = std::tan(fov_y_rad / 2.0) * width_by_height * (1.0 - 2.0 * margin);
  const double ce = std::cos(elevation_rad);
  const double se = std::sin(elevation_rad);
  double distance = nearest_m;
  // Round a circle a place at radius r is now at the side (x = r), now in front (z = r ce): the camera's
  // x = -r sin(a), y = -r cos(a) se + h ce, z = r cos(a) ce + h se for each angle a. The largest of what each
  // angle asks for; a degree apart it is within a 2e-4 of the true one.
  constexpr int angles = 360;
  // Only the outermost radius counts at a height; some thousands of places are still cheap.
  for (const glm::dvec3& place : places) {
    const double r = std::hypot(place.x - centre.x, place.y - centre.y);
    const double h = place.z - centre.z;
    // In front at its nearest, and as far out as it ever is: a bound that holds for every angle.
    const double bound =
        std::max({r / tx, (r * std::abs(se) + std::abs(h) * ce) / ty, nearest_m}) + r * ce + std::abs(h * se);
    if (bound <= distance) continue;
    for (int i = 0; i < angles; ++i) {
      const double a = i * glm::two_pi<double>() / angles;
      const double x = std::abs(r * std::sin(a));
      const double y = std::abs(h * ce - r * std::cos(a) * se);
      const double z = r * std::cos(a) * ce + h * se;
      distance = std::max({distance, x / tx + z, y / ty + z, z + nearest_m});
    }
  }
  return distance;
}

Shot::Shot(CameraPath path, const ShotPlan& plan)
    : path_(std::move(path)), changes_(plan.changes), rate_hz_(plan.rate_hz), frames_(plan.frames()) {}

Result<Shot> Shot::settle(const ShotPlan& plan, const std::vector<glm::dvec3>& visible_places) {
  if (plan.keys.empty())
    return make_error(ErrorCode::invalid_argument, "found none, expected one at least", "key");
  glm::dvec3 low(0.0);
  glm::dvec3 high(0.0);
  if (!visible_places.empty()) low = high = visible_places.front();
  for (const glm::dvec3& place : visible_places) {
    low = glm::min(low, place);
    high = glm::max(high, place);
  }
  const glm::dvec3 centre = (low + high) / 2.0;
  const double shape = static_cast<double>(plan.width_px) / plan.height_px;
  std::vector<CameraKey> keys;
  for (const PlannedKey& planned : plan.keys) {
    const bool about_scene = std::holds_alternative<SceneCentre>(planned.target);
    const auto* orbit = std::get_if<OrbitPlace>(&planned.place);
    if (visible_places.empty() && (about_scene || (orbit != nullptr && !orbit->distance_m))) {
      return make_error(ErrorCode::failed_precondition,
                        "the scene shows nothing that a camera could be turned to");
    }
    const glm::dvec3 target = about_scene ? centre : std::get<glm::dvec3>(planned.target);
    CameraKey key;
    key.time_s = planned.time_s;
    if (orbit != nullptr) {
      key.camera.target = target;
      key.camera.azimuth_rad = orbit->azimuth_rad;
      key.camera.elevation_rad = orbit->elevation_rad;
      key.camera.fov_y_rad = planned.fov_y_rad;
      key.camera.distance_m = orbit->distance_m.value_or(0.0);
      if (!orbit->distance_m) {
        key.camera.distance_m =
            turning_distance_m(visible_places, target, orbit->elevation_rad, planned.fov_y_rad, shape);
      }
    } else {
      const glm::dvec3& eye = std::get<glm::dvec3>(planned.place);
      if (glm::distance(eye, target) < 1e-6) {
        return make_error(ErrorCode::failed_precondition, "the eye is where it looks to", "key.eye");
      }
      const double before = keys.empty() ? OrbitCamera().azimuth_rad : keys.back().camera.azimuth_rad;
      key.camera = looking_from(eye, target, planned.fov_y_rad, before);
    }
    keys.push_back(key);
  }
  return Shot(CameraPath(std::move(keys), plan.easing, plan.ends), plan);
}

ShotView Shot::view(std::size_t index) const {
  const double time_s = static_cast<double>(index) / rate_hz_;
  ShotView view;
  view.camera = path_.at(time_s);
  constexpr double same_moment_s = 1e-9;
  for (const PlannedChange& change : changes_) {
    if (change.time_s > time_s + same_moment_s) break;
    if (change.show) view.show = change.show;
    if (change.shading) view.shading = change.shading;
  }
  return view;
}

std::shared_ptr<const Scene> shown_as(const std::shared_ptr<const Scene>& scene,
                                      Representation representation) {
  auto shown = std::make_shared<Scene>(*scene);
  for (auto& [id, entity] : shown->entities) {
    const bool points = entity->points != nullptr;
    const bool surface = entity->surface != nullptr;
    if (entity->kind != EntityKind::dual_shape || !points || !surface) continue;
    auto other = std::make_shared<Entity>(*entity);
    other->representation = representation;
    entity = std::move(other);
  }
  return shown;
}

}  // namespace handloft::client
