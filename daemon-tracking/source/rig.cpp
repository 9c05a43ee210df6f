#include "daemon-tracking/source/rig.h"

#include <numbers>

namespace handloft::tracking {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

/// A camera at `position` whose optical axis goes through `target`, the image's right side pointing down in
/// the world: mounted upright (portrait), so that one view holds the table and the head above it.
Isometry3d upright_camera(const Vector3d& position, const Vector3d& target) {
  const Vector3d forward = (target - position).normalized();
  const Vector3d right = forward.cross(Vector3d::UnitZ()).normalized();
  const Vector3d down = forward.cross(right);
  Isometry3d pose = Isometry3d::Identity();
  pose.linear().col(0) = down;
  pose.linear().col(1) = -right;
  pose.linear().col(2) = forward;
  pose.translation() = position;
  return pose;
}

CameraCalibration table_camera(std::string name, const Vector3d& position, const Vector3d& target) {
  CameraCalibration camera;
  camera.name = std::move(name);
  camera.role = CameraRole::table;
  camera.world_from_camera = upright_camera(position, target);
  return camera;
}

TagPlacement table_tag(int id, double x_m, double y_m) {
  TagPlacement tag;
  tag.id = id;
  tag.edge_m = 0.05;
  tag.body_from_tag.translation() = Vector3d(x_m, y_m, 0.0);
  return tag;
}

/// A tag on the head rig, its face turned left by `yaw` and up by `pitch` from straight ahead.
TagPlacement head_tag(int id, const Vector3d& position, double yaw_deg, double pitch_deg) {
  const double yaw = yaw_deg * std::numbers::pi / 180, pitch = pitch_deg * std::numbers::pi / 180;
  const Vector3d normal(-std::sin(yaw) * std::cos(pitch), std::sin(pitch), -std::cos(yaw) * std::cos(pitch));
  TagPlacement tag;
  tag.id = id;
  tag.edge_m = 0.045;
  const Vector3d right = Vector3d::UnitY().cross(normal).normalized();
  tag.body_from_tag.linear().col(0) = right;
  tag.body_from_tag.linear().col(1) = normal.cross(right);
  tag.body_from_tag.linear().col(2) = normal;
  tag.body_from_tag.translation() = position;
  return tag;
}

}  // namespace

Rig default_rig() {
  Rig rig;

  CameraCalibration left = table_camera("left", {-0.38, 0.54, 0.40}, {0.03, 0.0, 0.175});
  left.intrinsics.fx_px = 602.0;
  left.intrinsics.fy_px = 601.0;
  left.intrinsics.cx_px = 322.4;
  left.intrinsics.cy_px = 237.1;
  left.intrinsics.distortion = {-0.105, 0.031, 0.0006, -0.0004, 0.0};

  CameraCalibration right = table_camera("right", {0.52, 0.50, 0.40}, {0.07, 0.0, 0.175});
  right.intrinsics.fx_px = 597.0;
  right.intrinsics.fy_px = 598.5;
  right.intrinsics.cx_px = 316.8;
  right.intrinsics.cy_px = 241.9;
  right.intrinsics.distortion = {-0.092, 0.024, -0.0005, 0.0007, 0.0};

  CameraCalibration head;
  head.name = "head";
  head.role = CameraRole::head;
  head.intrinsics.fx_px = 590.0;
  head.intrinsics.fy_px = 590.5;
  head.intrinsics.cx_px = 320.6;
  head.intrinsics.cy_px = 238.7;
  head.intrinsics.distortion = {-0.118, 0.037, 0.0003, 0.0002, 0.0};
  // On the display's front, looking where the head looks: the camera's y and z run against the head's.
  head.head_from_camera.linear() = Vector3d(1.0, -1.0, -1.0).asDiagonal();
  head.head_from_camera.translation() = Vector3d(0.0, 0.02, -0.06);

  rig.cameras = {left, right, head};

  // Around the work and the palette, never under them (common/base/table_palette.h), spread wide: the hand
  // hides some.
  rig.table_tags = {
      table_tag(0, -0.17, 0.14),  table_tag(1, 0.0, 0.17),    table_tag(2, 0.15, 0.15),
      table_tag(3, -0.21, 0.0),   table_tag(4, -0.16, -0.14), table_tag(5, 0.0, -0.135),
      table_tag(6, 0.15, -0.145), table_tag(7, 0.30, -0.02),
  };
  // Faces 30 degrees apart and more, turned up from where the head looks, towards the table cameras.
  rig.head_tags = {
      head_tag(20, {0.0, 0.085, -0.055}, 0.0, 48.0),     head_tag(21, {-0.075, 0.065, -0.040}, 38.0, 40.0),
      head_tag(22, {0.075, 0.065, -0.040}, -38.0, 40.0), head_tag(23, {-0.050, 0.125, 0.005}, 25.0, 74.0),
      head_tag(24, {0.050, 0.125, 0.005}, -25.0, 74.0),
  };

  // Matte red, green, blue, yellow, magenta: at least 70 apart in (Cb, Cr), far from grey, wood and skin.
  rig.colours = {{
      {Finger::thumb, 95, 103, 217, 10, 10},
      {Finger::index, 130, 88, 64, 10, 10},
      {Finger::middle, 78, 208, 101, 10, 10},
      {Finger::ring, 195, 35, 153, 10, 10},
      {Finger::little, 115, 176, 196, 10, 10},
  }};
  rig.fingertip_radius_m = 0.008;
  return rig;
}

}  // namespace handloft::tracking
