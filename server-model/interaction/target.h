#pragma once
// Which shape the hand means (A25): one that was selected, else the nearest within reach. Reach is measured
// to the points and to the visible part of the surface (A22-A24), whichever the shape shows: nothing unseen
// is ever taken hold of.

#include <Eigen/Geometry>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server-model/model/document.h"

namespace handloft::interaction {

struct Near {
  std::string entity;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< Of the shape's place that is nearest, world.
  double distance_m = 0;
};

/// Remembers each shape's bounding box as long as the shape stays the same object, so that what is far away
/// costs nothing. A look at a shape within reach costs its points.
class TargetFinder {
 public:
  explicit TargetFinder(double reach_m) : reach_m_(reach_m) {}

  /// The dual shape nearest to the segment from..to that the hand's place has gone through since the last
  /// frame (a fast hand must not jump past a shape); nullopt: none within reach. Ties go to the smaller id.
  std::optional<Near> nearest(const model::Document& document, const Eigen::Vector3d& from,
                              const Eigen::Vector3d& to);
  /// All within reach, ascending by id.
  std::vector<Near> all_within_reach(const model::Document& document, const Eigen::Vector3d& from,
                                     const Eigen::Vector3d& to);
  /// This shape's nearest place, when it is within reach.
  std::optional<Near> within_reach(const model::Document& document, std::string_view entity,
                                   const Eigen::Vector3d& from, const Eigen::Vector3d& to);

 private:
  struct Known {
    model::DualPtr shape;                  ///< As it was looked at.
    std::vector<Eigen::Vector3d> surface;  ///< Places of its visible surface.
    Eigen::AlignedBox3d box;               ///< Of both.
  };
  /// The nearest place of one shape that is nearer than `limit_m`.
  std::optional<Near> look(const model::DualPtr& shape, const Eigen::Vector3d& from,
                           const Eigen::Vector3d& to, double limit_m);
  const Known& known(const model::DualPtr& shape);
  void forget_removed(const model::Document& document);

  double reach_m_;
  std::map<std::string, Known, std::less<>> known_;
};

}  // namespace handloft::interaction
