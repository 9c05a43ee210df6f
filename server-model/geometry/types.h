#pragma once
// Points, planes and frames: the nouns that every method of this room shares. Metres, right-handed.

#include <Eigen/Core>

namespace handloft::geometry {

using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

/// A point with the weight of its evidence: theta_i = rho_i, the pen's or hand's pressure 0..1 (A1, A6).
struct WeightedPoint {
  Vec3 position = Vec3::Zero();
  double weight = 1.0;
};

/// {p : (p - origin) . normal = 0}. `normal` has unit length where a function does not say otherwise.
struct Plane {
  Vec3 origin = Vec3::Zero();
  Vec3 normal = Vec3::UnitZ();
};

/// A rigid local coordinate system; the columns of `rotation` are its x, y and z axes in world coordinates,
/// orthonormal and right-handed. A surface is a height along z over the x-y plane of its frame.
struct Frame {
  Vec3 origin = Vec3::Zero();
  Mat3 rotation = Mat3::Identity();

  Vec3 x_axis() const { return rotation.col(0); }
  Vec3 y_axis() const { return rotation.col(1); }
  /// The base plane's normal: the direction along which residuals are measured (A6).
  Vec3 normal() const { return rotation.col(2); }
  Plane base_plane() const { return {origin, normal()}; }

  Vec3 to_local(const Vec3& world) const { return rotation.transpose() * (world - origin); }
  Vec3 to_world(const Vec3& local) const { return origin + rotation * local; }
  Vec3 direction_to_local(const Vec3& world) const { return rotation.transpose() * world; }
  Vec3 direction_to_world(const Vec3& local) const { return rotation * local; }
};

/// An axis-aligned rectangle in a frame's x-y plane, as centre and half extents (both >= 0, metres).
struct Box2 {
  Vec2 centre = Vec2::Zero();
  Vec2 half_extent = Vec2::Zero();

  Vec2 lower() const { return centre - half_extent; }
  Vec2 upper() const { return centre + half_extent; }
};

}  // namespace handloft::geometry
