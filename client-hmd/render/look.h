#pragma once
// How surfaces are looked at (V3): under which light, and with which lines over them. Designers judge a
// surface by what its reflections do, so most choices are about reflections. Names as on the command line and
// in menus.

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace handloft::client {

/// How surfaces are lit or coloured.
enum class Shading : std::uint8_t {
  studio,     ///< Softboxes and a pale sky: a satin shell in each shape's own colour.
  clay,       ///< Matt modelling clay: form without reflections.
  car_paint,  ///< Dark paint under a clear coat: long highlights that flow with the curvature.
  silver,     ///< Polished metal: the whole room is mirrored.
  zebra,      ///< Stripes that are mirrored: bent where the curvature changes, broken where the tangent does.
  curvature,  ///< Colours for one kind of curvature.
};

enum class CurvatureKind : std::uint8_t {
  mean,      ///< (k1 + k2) / 2
  gaussian,  ///< k1 k2, as its root with its sign, so that it has the others' unit.
  largest,   ///< k1, the more convex one.
  smallest,  ///< k2
};

/// Curvature in 1/m: 20 is a radius of 50 mm. Positive: bent as a ball is, seen from its outside.
struct CurvatureView {
  CurvatureKind kind = CurvatureKind::mean;
  /// At the ends of the colours, on either side; 0: chosen so that 95 % of what is seen of a shape lies
  /// within (of the middle one, where there are several).
  float range_per_m = 0.0F;
  bool operator==(const CurvatureView&) const = default;
};

/// Lines over surfaces; any of them, with any shading.
struct SurfaceOverlays {
  bool wires = false;         ///< The triangles' edges.
  bool control_nets = false;  ///< The B-spline's control points and the lines between them.
  bool isophotes = false;     ///< Lines of equal brightness under one lamp.
  bool operator==(const SurfaceOverlays&) const = default;
};

/// What is beyond the contour of opacity 0.5.
enum class SurfaceEdges : std::uint8_t {
  soft,     ///< The falloff as it is (A23, A24): how sure the edge is.
  trimmed,  ///< Nothing: the shape as it would be exported (A26).
};

/// What stands about the work where no film does.
enum class Surroundings : std::uint8_t {
  workplace,  ///< The table with its grid and its palette.
  bare,       ///< A bare table, for pictures of the work alone.
};

template <typename Choice>
struct NamedChoice {
  Choice choice;
  std::string_view name;   ///< On the command line.
  std::string_view words;  ///< In a menu.
};

std::span<const NamedChoice<Shading>> shadings();
std::span<const NamedChoice<CurvatureKind>> curvature_kinds();

std::optional<Shading> shading_named(std::string_view name);
std::optional<CurvatureKind> curvature_kind_named(std::string_view name);
/// "wires,net,isophotes" in any order, "none" or nothing: none. nullopt for an unknown word.
std::optional<SurfaceOverlays> overlays_named(std::string_view comma_separated);
std::string_view name_of(Shading shading);
std::string_view name_of(CurvatureKind kind);

/// The one after it in the order of shadings(), for a key; after the last the first.
Shading next_shading(Shading shading);
CurvatureKind next_curvature_kind(CurvatureKind kind);
/// Another combination with every call, through none, wires, net, both: for a key.
SurfaceOverlays next_overlays(const SurfaceOverlays& overlays);

}  // namespace handloft::client
