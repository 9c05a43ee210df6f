#pragma once
// Which icon of a sculpted surface a hand means, and which surface it would add one to (seed 003, step 3 of
// D19): the nearest within reach. Curves and the borders of regions are reached anywhere along them.

#include <Eigen/Geometry>
#include <compare>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "server-model/geometry/bspline_projection.h"
#include "server-model/model/document.h"
#include "server-model/model/sculpt_shape.h"

namespace handloft::interaction {

/// An icon's id is unique within its surface.
struct IconName {
  std::string entity;
  std::string icon;

  bool empty() const { return icon.empty(); }
  auto operator<=>(const IconName&) const = default;
};

struct NearIcon {
  IconName name;
  double distance_m = 0;
  double along = 0;  ///< Of a curve: where the nearest place is, 0..1 of its length.
};

struct NearSculpted {
  std::string entity;
  double distance_m = 0;
};

/// The sensors that an icon lists (D17).
inline constexpr std::string_view hand_sensor = "hand";
inline constexpr std::string_view space_mouse_sensor = "spacemouse";

/// Null: there is no such icon.
const model::SculptIcon* find_icon(const model::Document& document, const IconName& name);

/// Whether `sensor` drives the icon: it is driving and lists the sensor. A hand also drives what lists none:
/// icons of scripts and peers say nothing of sensors.
bool is_driven_by(const model::SculptIcon& icon, std::string_view sensor);

/// Remembers what was prepared of each surface as long as it stays the same object, as it does while it is
/// only dragged in the air. A look at a far surface costs a box.
class IconFinder {
 public:
  explicit IconFinder(double reach_m) : reach_m_(reach_m) {}

  /// nullopt: none within reach. Icons in `but` are left out; ties go to the smaller entity, then to the
  /// older icon.
  std::optional<NearIcon> nearest(const model::Document& document, const Eigen::Vector3d& at,
                                  const std::set<IconName>& but = {});
  /// This icon, when it is within reach.
  std::optional<NearIcon> within_reach(const model::Document& document, const IconName& name,
                                       const Eigen::Vector3d& at);
  /// The sculpted surface whose visible part is nearest; `entity` empty: of all. nullopt: none within reach.
  std::optional<NearSculpted> nearest_surface(const model::Document& document, const Eigen::Vector3d& at,
                                              std::string_view entity = {});

 private:
  struct Known {
    model::SculptPtr shape;   ///< As it was looked at.
    Eigen::AlignedBox3d box;  ///< Of the control points: the surface is within.
    std::optional<geometry::SurfaceProjector> projector;
    bool projectable = true;
    std::vector<std::vector<Eigen::Vector3d>> outlines;  ///< An icon each, in their order.
  };
  Known& known(const model::SculptPtr& shape);
  void forget_removed(const model::Document& document);
  static NearIcon look(const Known& known, std::size_t index, const Eigen::Vector3d& at);

  double reach_m_;
  std::map<std::string, Known, std::less<>> known_;
};

}  // namespace handloft::interaction
