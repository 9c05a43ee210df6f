#pragma once
// The scene as a viewer holds it: a value made of immutable, shared parts, so that the network thread can
// build the next one while the frame loop draws the last (V5). Lengths in metres, world frame.

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client-hmd/mirror/shared_work.h"

namespace handloft::client {

struct Vec3f {
  float x = 0.0F, y = 0.0F, z = 0.0F;
  bool operator==(const Vec3f&) const = default;
};

/// Five nested spheres, outer to inner, composited 'over' in that order (A2, A3); as the server decided them.
struct ShellStyle {
  float radius_m = 0.0F;
  std::array<float, 5> shell_radius_m{};
  std::array<float, 5> shell_alpha{};
  bool operator==(const ShellStyle&) const = default;
};

/// A point as the graphics card reads it: 16 bytes.
struct FuzzyPoint {
  Vec3f position;
  std::uint32_t style = 0;  ///< Index into PointSet::styles, always valid.
};

struct PointSet {
  std::vector<FuzzyPoint> points;
  std::vector<ShellStyle> styles;
};

/// A vertex as the graphics card reads it: 28 bytes.
struct SurfaceVertex {
  Vec3f position;
  Vec3f normal;          ///< Unit.
  float opacity = 1.0F;  ///< 0..1 (A23)
};

struct SurfaceMesh {
  std::vector<SurfaceVertex> vertices;
  std::vector<std::uint32_t> indices;  ///< Three a triangle, always valid.
  std::uint64_t topology = 0;  ///< The mirror's: meshes with the same one, not 0, have the same indices.
};

enum class CurveKind { curve, profile, boundary };

struct SceneCurve {
  std::vector<Vec3f> points;
  bool closed = false;
  std::uint32_t colour_rgba = 0;  ///< 0: the viewer's choice for the kind.
  CurveKind kind = CurveKind::curve;
  bool operator==(const SceneCurve&) const = default;
};

enum class Representation { points, surface, both };

enum class IconShape { point, curve, region };
enum class IconProperty { position, derivative, normal };
enum class IconState { driving, passive, sleeping };

/// What constrains or loads a sculpted surface (D6 - D17), as the server decided its colour.
struct SceneIcon {
  std::string id;
  IconShape shape = IconShape::point;
  bool load = false;  ///< Else a constraint.
  IconProperty property = IconProperty::position;
  IconState state = IconState::driving;
  Vec3f place;
  std::optional<Vec3f> direction;  ///< Unit.
  std::vector<Vec3f> outline;      ///< Of curves and regions; a region's ends where it begins.
  std::string label;               ///< "R", "V2", ...; empty: none.
  std::uint32_t colour_rgba = 0;
  bool target = false;  ///< What a hand would pick now.
  bool held = false;    ///< Driven now.
  bool operator==(const SceneIcon&) const = default;
};

/// What an entity is: a shape that hands work on, an imported mesh to design around (A28), a surface that is
/// sculpted by icons, or the rest of an imported CAD model.
enum class EntityKind { dual_shape, reference, sculpt_surface, cad_model };

struct Entity {
  std::string id;
  std::string name;
  EntityKind kind = EntityKind::dual_shape;
  std::uint64_t revision = 0;
  Representation representation = Representation::points;
  bool provisional = false;
  std::uint64_t provisional_by = 0;            ///< Whose gesture, a client's id; 0: the tracked hand's.
  bool selected = false;                       ///< What gestures act on.
  bool target = false;                         ///< What the hand would act on now: nearest within reach.
  std::shared_ptr<const PointSet> points;      ///< Null: none.
  std::uint32_t settled_points = 0;            ///< Those that stood before the gesture that is in the air.
  std::shared_ptr<const SurfaceMesh> surface;  ///< Null: none.
  std::uint64_t wire_topology = 0;             ///< What the server calls the surface's triangles.
  std::uint64_t surface_id = 0;  ///< And the surface itself, to say what is held (U3); 0: unknown.
  /// One a vertex of `surface`, signed metres to the nearest reference, positive on the side of its outward
  /// normals; null: not compared, or not measured yet.
  std::shared_ptr<const std::vector<float>> distances_m;
  std::shared_ptr<const std::vector<SceneCurve>> curves;
  std::shared_ptr<const std::vector<SceneIcon>> icons;  ///< Null: none.
  double residual_rms_m = 0.0;
  std::uint64_t leased_by = 0;  ///< The client that shapes it for some seconds (U1); 0: nobody.
  std::string leased_by_name;

  bool shows_points() const { return points != nullptr && representation != Representation::surface; }
  bool shows_surface() const { return surface != nullptr && representation != Representation::points; }
};

struct History {
  std::uint32_t undo_steps = 0;
  std::uint32_t redo_steps = 0;
  std::string next_undo;
  std::string next_redo;
  std::string undo_refused = {};  ///< Why the next undo would be refused now; empty: it would not.
  std::string redo_refused = {};
};

/// Variants of the document, of which one is present (A28).
struct Alternatives {
  std::string present;             ///< One of `names`; empty when there are none.
  std::vector<std::string> names;  ///< In the document's order.
};

struct Scene {
  std::uint64_t epoch = 0;     ///< Changes with every start of the server.
  std::uint64_t sequence = 0;  ///< Operations applied.
  std::map<std::string, std::shared_ptr<const Entity>> entities;
  History history;
  Alternatives alternatives;
  Storage storage;
  std::shared_ptr<const std::vector<PinnedComment>> comments;  ///< Null: none.
  std::shared_ptr<const std::vector<NamedVersion>> versions;   ///< Null: none.
};

}  // namespace handloft::client
