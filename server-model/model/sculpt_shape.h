#pragma once
// The sculpted surface (seed 003, requirements D1 - D21): a B-spline surface at rest, icons that constrain or
// load it, and the surface that least energy makes of both. Immutable once in a document; documents share it.

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "proto/operation.pb.h"
#include "server-model/geometry/bspline_surface.h"
#include "server-model/geometry/sculpt_energy.h"
#include "server-model/geometry/types.h"
#include "server-model/model/entity.h"

namespace handloft::model {

enum class IconShape : std::uint8_t { point, curve, region };
enum class IconRole : std::uint8_t { constraint, load };
/// What a point icon that is a constraint holds (D6 - D8).
enum class IconProperty : std::uint8_t { position, tangent_u, tangent_v, second_u, second_v, twist, normal };
enum class IconState : std::uint8_t {
  driving,   ///< Follows its sensors, and acts.
  passive,   ///< No sensor; a constraint holds, a load does nothing.
  sleeping,  ///< Does nothing.
};

/// One step of a bent curve icon: the places at `held_at` along it move by the translation, others by eta
/// (A15) of their distance along the curve over `reach_m`.
struct IconBend {
  double held_at = 0;
  double reach_m = 0;
  geometry::Vec3 translation = geometry::Vec3::Zero();
};

/// The record of an icon (D17). What it holds is given by where its rows were when it began to act
/// (`reference`) and the motion since.
struct SculptIcon {
  std::string id;
  IconShape shape = IconShape::point;
  IconRole role = IconRole::constraint;
  IconProperty property = IconProperty::position;
  IconState state = IconState::driving;
  bool outside = false;  ///< A region constraint that holds all but its inside.
  std::vector<geometry::Vec2>
      parameters;        ///< Point: one; curve: its corners; region: lower and upper corner.
  double stiffness = 0;  ///< N/m of a load; 0: by the compliance (D16).
  std::vector<std::string> sensors;
  /// Values of its rows' functionals on the surface when it began to act, and the pivot of its motion.
  std::shared_ptr<const std::vector<geometry::Vec3>> reference;
  geometry::Vec3 pivot = geometry::Vec3::Zero();
  geometry::Vec3 translation = geometry::Vec3::Zero();  ///< The motion since: p -> pivot + R (p - pivot) + t.
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  std::vector<IconBend> bends;                    ///< Of curves, applied after the motion, in order.
  geometry::Vec3 place = geometry::Vec3::Zero();  ///< Where it is shown: D14.

  /// Whether it changes the surface (Table 1, D13): driving ones, and passive constraints.
  bool acts() const {
    return state == IconState::driving || (state == IconState::passive && role == IconRole::constraint);
  }
};

/// What was said of an icon: told again only when it becomes worse, or the icon itself is worked on.
struct IconRemark {
  enum class Kind : std::uint8_t { adds_nothing, off, followed, steep };
  std::string icon;
  Kind kind = Kind::adds_nothing;
  double off = 0;  ///< In what the remark gives.
};

/// The trim of a face: closed loops of rational B-splines in the parameter plane, the outer one first, the
/// face on their left.
struct TrimSpline {
  geometry::KnotVector knots;
  std::vector<geometry::Vec2> control;
  std::vector<double> weights;  ///< Empty: all 1.
};
using FaceTrim = std::vector<std::vector<TrimSpline>>;

struct SculptShape final : Entity {
  std::shared_ptr<const geometry::BSplineSurface>
      initial;  ///< As made or imported: what recover restores (D19).
  std::shared_ptr<const geometry::BSplineSurface> rest;  ///< As committed: what yields (D4).
  std::shared_ptr<const geometry::BSplineSurface>
      surface;  ///< Under its icons. Same knots and weights as `rest`.
  std::shared_ptr<const std::vector<SculptIcon>> icons = std::make_shared<const std::vector<SculptIcon>>();
  geometry::SculptEnergy energy;
  geometry::SculptSupports supports;
  bool absolute = false;       ///< D4: a plane is at rest, instead of `rest`.
  bool least_squares = false;  ///< D20: constraints that contradict are met in the mean.
  /// What was last said of its icons. No part of the design: without it, things are said once more.
  std::vector<IconRemark> remarks;
  std::shared_ptr<const FaceTrim> trim;  ///< Null: the whole parameter rectangle.
  std::string model;                     ///< The CAD model whose face it is; empty: none.
  std::uint32_t face = 0;                ///< Its number there, from 1.
  bool reversed = false;                 ///< Its outside is against du x dv.

  EntityKind kind() const override { return EntityKind::sculpt_surface; }
  std::shared_ptr<Entity> clone() const override { return std::make_shared<SculptShape>(*this); }

  /// Null when there is none of that id.
  const SculptIcon* find_icon(std::string_view id) const;
};
using SculptPtr = std::shared_ptr<const SculptShape>;

/// The entity as a sculpted surface; null when it is null or of another kind.
inline SculptPtr as_sculpt(const EntityPtr& entity) {
  return entity && entity->kind() == EntityKind::sculpt_surface
             ? std::static_pointer_cast<const SculptShape>(entity)
             : nullptr;
}

std::string_view to_string(IconShape shape);        ///< "point", "curve", "region"
std::string_view to_string(IconRole role);          ///< "constraint", "load"
std::string_view to_string(IconProperty property);  ///< "position", "tangent_u", ..., "normal"
std::string_view to_string(IconState state);        ///< "driving", "passive", "sleeping"

/// As the paper labels derivatives: "R", "V", "R2", "V2", "RV"; else empty.
std::string_view icon_label(const SculptIcon& icon);

handloft::v1::IconShape to_proto(IconShape shape);
handloft::v1::IconRole to_proto(IconRole role);
handloft::v1::IconProperty to_proto(IconProperty property);
handloft::v1::IconState to_proto(IconState state);

}  // namespace handloft::model
