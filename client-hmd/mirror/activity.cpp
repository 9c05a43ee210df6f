#include "client-hmd/mirror/activity.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "client-hmd/mirror/read_curve.h"

namespace handloft::client {
namespace {

Error corrupt(std::string field, std::string message) {
  return make_error(ErrorCode::data_corrupt, std::move(message), std::move(field));
}

Result<Vec3f> read_place(const v1::Vec3& v, const char* field, const ActivityLimits& limits) {
  for (const double value : {v.x(), v.y(), v.z()}) {
    if (!std::isfinite(value) || std::abs(value) > limits.max_coordinate_m) {
      return corrupt(field, fmt::format("expected a place within {} m", limits.max_coordinate_m));
    }
  }
  return Vec3f{static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

Result<Vec3f> read_direction(const v1::Vec3& v, const char* field) {
  const double length = std::hypot(v.x(), v.y(), v.z());
  constexpr double shortest = 1e-9;
  if (!std::isfinite(length) || length < shortest) {
    return corrupt(field, "found no direction, expected a vector that can be normalised");
  }
  return Vec3f{static_cast<float>(v.x() / length), static_cast<float>(v.y() / length),
               static_cast<float>(v.z() / length)};
}

Result<DiskMark> read_disk(const v1::DiskPose& pose, const ActivityLimits& limits) {
  const Result<Vec3f> centre = read_place(pose.centre(), "disk.centre", limits);
  if (!centre) return centre.error();
  const Result<Vec3f> normal = read_direction(pose.normal(), "disk.normal");
  if (!normal) return normal.error();
  if (!(pose.radius_m() >= 0.0 && pose.radius_m() <= limits.max_disk_radius_m)) {
    return corrupt("disk.radius_m",
                   fmt::format("found {}, expected 0..{}", pose.radius_m(), limits.max_disk_radius_m));
  }
  return DiskMark{*centre, *normal, static_cast<float>(pose.radius_m())};
}

Result<PlaneMark> read_plane(const v1::Plane& plane, const ActivityLimits& limits) {
  const Result<Vec3f> origin = read_place(plane.origin(), "symmetry_plane.origin", limits);
  if (!origin) return origin.error();
  const Result<Vec3f> normal = read_direction(plane.normal(), "symmetry_plane.normal");
  if (!normal) return normal.error();
  return PlaneMark{*origin, *normal};
}

}  // namespace

Result<Activity> read_activity(const v1::Presence& presence, const ActivityLimits& limits) {
  const auto shortened = [&limits](const std::string& text) { return text.substr(0, limits.max_text_bytes); };
  Activity activity;
  activity.client_id = presence.client_id();
  activity.name = shortened(presence.name());
  activity.tool = shortened(presence.tool());
  activity.entity = shortened(presence.entity());
  activity.mode = shortened(presence.mode());
  activity.symmetry = presence.symmetry();
  activity.smooth_falloff = presence.falloff() == v1::FALLOFF_SMOOTH;
  activity.palette_page = presence.palette_page();
  if (presence.has_symmetry_plane()) {
    const Result<PlaneMark> plane = read_plane(presence.symmetry_plane(), limits);
    if (!plane) return plane.error();
    activity.symmetry_plane = *plane;
  }
  if (presence.has_disk()) {
    const Result<DiskMark> disk = read_disk(presence.disk(), limits);
    if (!disk) return disk.error();
    activity.disk = *disk;
  }
  if (!(presence.range() >= 0.0 && presence.range() <= 1.0)) {
    return corrupt("range", fmt::format("found {}, expected 0..1", presence.range()));
  }
  activity.range = static_cast<float>(presence.range());
  if (presence.has_curve()) {
    Result<SceneCurve> curve =
        read_curve(presence.curve(), {limits.max_curve_points, limits.max_coordinate_m});
    if (!curve) return make_error(curve.error().code, curve.error().message, "curve." + curve.error().field);
    activity.curve = std::make_shared<const SceneCurve>(std::move(*curve));
  }
  return activity;
}

}  // namespace handloft::client
