#include "client-hmd/mirror/read_entity.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "client-hmd/mirror/read_curve.h"
#include "client-hmd/mirror/read_distances.h"
#include "client-hmd/mirror/read_icons.h"
#include "common/codec/mesh_codec.h"
#include "common/codec/point_codec.h"

namespace handloft::client {
namespace {

Error corrupt(std::string field, std::string message) {
  return make_error(ErrorCode::data_corrupt, std::move(message), std::move(field));
}

/// The error with `prefix` before its field.
Error within(const std::string& prefix, const Error& error) {
  return make_error(error.code, error.message, error.field.empty() ? prefix : prefix + "." + error.field);
}

/// Bit for bit, so that what is no number could not make a part differ from itself.
template <typename T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  static_assert(std::is_trivially_copyable_v<T>);
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}
static_assert(sizeof(FuzzyPoint) == 16 && sizeof(SurfaceVertex) == 28, "no padding to compare");

Vec3f to_float(const std::array<double, 3>& p) {
  return {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
}

Result<ShellStyle> check_style(const codec::FuzzyStyle& style, const MirrorLimits& limits) {
  const auto radius_ok = [&limits](float r) {
    return std::isfinite(r) && r >= 0.0F && r <= limits.max_radius_m;
  };
  const auto alpha_ok = [](float a) { return std::isfinite(a) && a >= 0.0F && a <= 1.0F; };
  if (!radius_ok(style.radius_m) ||
      !std::all_of(style.shell_radius_m.begin(), style.shell_radius_m.end(), radius_ok)) {
    return corrupt("palette.radius_m", fmt::format("expected radii of 0..{} m", limits.max_radius_m));
  }
  if (!std::all_of(style.shell_alpha.begin(), style.shell_alpha.end(), alpha_ok)) {
    return corrupt("palette.shell_alpha", "expected opacities of 0..1");
  }
  return ShellStyle{style.radius_m, style.shell_radius_m, style.shell_alpha};
}

/// Adds styles to a palette that has each once.
class StyleUnion {
 public:
  StyleUnion(std::vector<ShellStyle>& styles, std::size_t to_come) : styles_(styles) {
    // Few are found sooner by looking; a hostile palette of thousands must not take a second.
    constexpr std::size_t most_comparisons = 1U << 14;
    indexed_ = styles.size() * to_come > most_comparisons || to_come * to_come > most_comparisons;
    for (std::size_t i = 0; indexed_ && i < styles.size(); ++i) index_.emplace(bits(styles[i]), i);
  }
  std::uint32_t add(const ShellStyle& style) {
    std::size_t at = styles_.size();
    if (indexed_) {
      at = index_.emplace(bits(style), at).first->second;
    } else {
      at = static_cast<std::size_t>(std::find(styles_.begin(), styles_.end(), style) - styles_.begin());
    }
    if (at == styles_.size()) styles_.push_back(style);
    return static_cast<std::uint32_t>(at);
  }

 private:
  static std::string bits(const ShellStyle& style) {
    return {reinterpret_cast<const char*>(&style), sizeof(style)};
  }
  std::vector<ShellStyle>& styles_;
  bool indexed_ = false;
  std::unordered_map<std::string, std::size_t> index_;
};
static_assert(sizeof(ShellStyle) == 11 * sizeof(float), "no padding to compare");

using PointsPart = std::shared_ptr<const PointSet>;

/// The cloud after `message`, given the one held before (null: none).
Result<PointsPart> merge_points(const PointSet* held, const v1::PointCloud& message,
                                const MirrorLimits& room) {
  codec::PointLimits limits;
  limits.max_points = std::min(limits.max_points, room.max_points);
  limits.max_styles = std::min(limits.max_styles, room.max_styles);
  limits.max_coordinate_m = room.max_coordinate_m;
  Result<codec::PointTail> decoded = codec::decode_points(message, limits);
  if (!decoded) return within("points", decoded.error());
  const codec::PointTail& tail = *decoded;
  const std::size_t before = held == nullptr ? 0 : held->points.size();
  if (tail.first > before) {
    return corrupt("points.first",
                   fmt::format("found {}, expected at most the {} points held", tail.first, before));
  }
  auto set = std::make_shared<PointSet>();
  if (tail.first > 0) {
    set->styles = held->styles;
    set->points.reserve(tail.total);
    set->points.assign(held->points.begin(), held->points.begin() + tail.first);
  }
  // The message's styles, as indices into the united palette.
  std::vector<std::uint32_t> united;
  united.reserve(tail.palette.size());
  StyleUnion palette(set->styles, tail.palette.size());
  for (const codec::FuzzyStyle& style : tail.palette) {
    const Result<ShellStyle> checked = check_style(style, room);
    if (!checked) return within("points", checked.error());
    united.push_back(palette.add(*checked));
  }
  if (set->styles.size() > limits.max_styles) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found {}, expected at most {}", set->styles.size(), limits.max_styles),
                      "points.palette");
  }
  for (std::size_t i = 0; i < tail.positions.size(); ++i) {
    set->points.push_back({to_float(tail.positions[i]), united[tail.styles[i]]});
  }
  return PointsPart(std::move(set));
}

using SurfacePart = std::shared_ptr<const SurfaceMesh>;

/// The mesh of `message`; one that leaves out its triangles has those of the base.
Result<SurfacePart> read_surface(const EntityBefore& before, const v1::Mesh& message,
                                 const MirrorLimits& room, TopologyNumbers& topologies) {
  codec::MeshLimits limits;
  limits.max_vertices = std::min(limits.max_vertices, room.max_vertices);
  limits.max_indices = std::min(limits.max_indices, room.max_indices);
  limits.max_coordinate_m = room.max_coordinate_m;
  codec::KnownTriangles known;
  if (before.base != nullptr && before.base->surface != nullptr) {
    known = {before.base->wire_topology, before.base->surface->indices};
  }
  Result<codec::MeshData> decoded = codec::decode_mesh(message, limits, known);
  if (!decoded) return within("surface", decoded.error());
  auto mesh = std::make_shared<SurfaceMesh>();
  mesh->vertices.reserve(decoded->positions.size());
  for (std::size_t i = 0; i < decoded->positions.size(); ++i) {
    const auto& p = decoded->positions[i];
    const auto& n = decoded->normals[i];
    mesh->vertices.push_back(
        {{p[0], p[1], p[2]}, {n[0], n[1], n[2]}, static_cast<float>(decoded->opacity[i]) / 255.0F});
  }
  mesh->indices = std::move(decoded->indices);
  const SurfacePart shown = before.shown == nullptr ? nullptr : before.shown->surface;
  const bool same_triangles = shown != nullptr && same_bits(shown->indices, mesh->indices);
  if (same_triangles && same_bits(shown->vertices, mesh->vertices)) return shown;
  mesh->topology = same_triangles ? shown->topology : topologies.next();
  return SurfacePart(std::move(mesh));
}

using CurvesPart = std::shared_ptr<const std::vector<SceneCurve>>;

Result<CurvesPart> read_curves(const v1::EntityState& state, const MirrorLimits& limits) {
  if (state.curves().empty()) return CurvesPart();
  const auto lines = static_cast<std::size_t>(state.curves_size());
  if (lines > limits.max_curves) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found {}, expected at most {}", lines, limits.max_curves), "curves");
  }
  auto curves = std::make_shared<std::vector<SceneCurve>>();
  curves->reserve(lines);
  std::size_t total = 0;
  for (const v1::Polyline& line : state.curves()) {
    Result<SceneCurve> curve = read_curve(line, {limits.max_curve_points - total, limits.max_coordinate_m});
    if (!curve) return within("curves", curve.error());
    total += curve->points.size();
    curves->push_back(std::move(*curve));
  }
  return CurvesPart(std::move(curves));
}

Result<Representation> read_representation(v1::Representation representation) {
  switch (representation) {
    case v1::REPRESENTATION_UNSPECIFIED:
    case v1::REPRESENTATION_POINTS:
      return Representation::points;
    case v1::REPRESENTATION_SURFACE:
      return Representation::surface;
    case v1::REPRESENTATION_BOTH:
      return Representation::both;
    default:
      return corrupt("representation",
                     fmt::format("found {}, expected 0..3", static_cast<int>(representation)));
  }
}

/// Absent: a shape, as before there were references.
Result<EntityKind> read_kind(const std::string& kind) {
  if (kind.empty() || kind == "dual_shape") return EntityKind::dual_shape;
  if (kind == "reference") return EntityKind::reference;
  if (kind == "sculpt_surface") return EntityKind::sculpt_surface;
  if (kind == "cad_model") return EntityKind::cad_model;
  return corrupt("kind",
                 fmt::format("found {} bytes, expected dual_shape, reference, sculpt_surface or cad_model",
                             kind.size()));
}

/// Surface and distances after `state`: distances come with the surface that they belong to, even when only
/// they are new.
Status read_surface_state(const EntityBefore& before, const v1::EntityState& state, const MirrorLimits& room,
                          TopologyNumbers& topologies, Entity& entity) {
  const bool surface_comes = state.surface_shown() && state.has_surface();
  if (!surface_comes && !state.distances().empty()) {
    return corrupt("distances", "came without the surface that they belong to");
  }
  if (!state.surface_shown()) {
    entity.surface = nullptr;
    entity.surface_id = 0;
    entity.distances_m = nullptr;
  }
  if (!surface_comes) return {};
  Result<SurfacePart> surface = read_surface(before, state.surface(), room, topologies);
  if (!surface) return surface.error();
  entity.surface = std::move(*surface);
  entity.wire_topology = state.surface().topology();
  entity.surface_id = state.surface_id();
  entity.distances_m = nullptr;
  if (state.distances().empty()) return {};
  Result<std::vector<float>> distances = read_distances(state.distances(), entity.surface->vertices.size());
  if (!distances) return distances.error();
  entity.distances_m = std::make_shared<const std::vector<float>>(std::move(*distances));
  return {};
}

/// Checked also when they are not to be shown, so that nothing hides in a message.
Status read_icon_state(const v1::EntityState& state, const MirrorLimits& limits, Entity& entity) {
  Result<std::vector<SceneIcon>> icons =
      read_icons(state.icons(), {.max_icons = std::min(limits.max_icons, limits.max_entity_icons),
                                 .max_outline_points = limits.max_curve_points,
                                 .max_text_bytes = limits.max_text_bytes,
                                 .max_coordinate_m = limits.max_coordinate_m});
  if (!icons) return icons.error();
  if (!state.icons_shown()) return {};
  entity.icons = icons->empty() ? nullptr : std::make_shared<const std::vector<SceneIcon>>(std::move(*icons));
  return {};
}

/// What was shown before, where it is the same.
void share_equal_parts(const Entity* shown, Entity& entity) {
  if (shown == nullptr) return;
  const auto equal = [](const auto& a, const auto& b) { return a != nullptr && b != nullptr && *a == *b; };
  if (entity.points != nullptr && shown->points != nullptr &&
      same_bits(entity.points->points, shown->points->points) &&
      entity.points->styles == shown->points->styles) {
    entity.points = shown->points;
  }
  if (entity.surface == shown->surface && entity.distances_m != nullptr && shown->distances_m != nullptr &&
      same_bits(*entity.distances_m, *shown->distances_m)) {
    entity.distances_m = shown->distances_m;
  }
  if (equal(entity.curves, shown->curves)) entity.curves = shown->curves;
  if (equal(entity.icons, shown->icons)) entity.icons = shown->icons;
}

}  // namespace

Result<std::shared_ptr<const Entity>> read_entity(const EntityBefore& before, const v1::EntityState& state,
                                                  const MirrorLimits& room, TopologyNumbers& topologies) {
  if (state.id().empty() || state.id().size() > room.max_text_bytes) {
    return corrupt("id",
                   fmt::format("found {} bytes, expected 1..{}", state.id().size(), room.max_text_bytes));
  }
  if (state.name().size() > room.max_text_bytes) {
    return corrupt(
        "name", fmt::format("found {} bytes, expected at most {}", state.name().size(), room.max_text_bytes));
  }
  const Entity* held = before.base;
  auto entity = held == nullptr ? std::make_shared<Entity>() : std::make_shared<Entity>(*held);
  entity->id = state.id();
  entity->name = state.name().empty() ? state.id() : state.name();
  const Result<EntityKind> kind = read_kind(state.kind());
  if (!kind) return kind.error();
  entity->kind = *kind;
  entity->revision = state.revision();
  entity->provisional = state.provisional();
  if (state.leased_by_name().size() > room.max_text_bytes) {
    return make_error(ErrorCode::data_corrupt, "expected a shorter name", "leased_by_name");
  }
  entity->leased_by = state.leased_by();
  entity->leased_by_name = state.leased_by_name();
  entity->provisional_by = state.provisional() ? state.provisional_by() : 0;
  entity->selected = state.selected();
  entity->target = state.target();
  const Result<Representation> representation = read_representation(state.representation());
  if (!representation) return representation.error();
  entity->representation = *representation;
  if (!std::isfinite(state.residual_rms_m())) return corrupt("residual_rms_m", "expected a finite number");
  entity->residual_rms_m = state.residual_rms_m();
  if (state.has_points()) {
    Result<PointsPart> points =
        merge_points(held == nullptr ? nullptr : held->points.get(), state.points(), room);
    if (!points) return points.error();
    entity->points = std::move(*points);
  }
  const std::size_t count = entity->points == nullptr ? 0 : entity->points->points.size();
  const std::size_t settled =
      state.provisional() ? std::min<std::size_t>(entity->settled_points, count) : count;
  entity->settled_points = static_cast<std::uint32_t>(settled);
  if (const Status surface = read_surface_state(before, state, room, topologies, *entity); !surface) {
    return surface.error();
  }
  Result<CurvesPart> curves = read_curves(state, room);
  if (!curves) return curves.error();
  if (state.curves_shown()) entity->curves = std::move(*curves);
  if (const Status icons = read_icon_state(state, room, *entity); !icons) return icons.error();
  share_equal_parts(before.shown, *entity);
  return std::shared_ptr<const Entity>(std::move(entity));
}

}  // namespace handloft::client
