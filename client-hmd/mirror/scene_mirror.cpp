#include "client-hmd/mirror/scene_mirror.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
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
Error too_many(std::string field, std::size_t found, std::size_t limit) {
  return make_error(ErrorCode::resource_exhausted, fmt::format("found {}, expected at most {}", found, limit),
                    std::move(field));
}

/// The error with `prefix` before its field.
Error within(const std::string& prefix, const Error& error) {
  return make_error(error.code, error.message, error.field.empty() ? prefix : prefix + "." + error.field);
}

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

/// The cloud after `message`, given the one held before (null: none).
Result<std::shared_ptr<const PointSet>> merge_points(const PointSet* held, const v1::PointCloud& message,
                                                     const MirrorLimits& limits) {
  codec::PointLimits codec_limits;
  codec_limits.max_points = std::min(codec_limits.max_points, limits.max_points);
  codec_limits.max_coordinate_m = limits.max_coordinate_m;
  Result<codec::PointTail> decoded = codec::decode_points(message, codec_limits);
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
  for (const codec::FuzzyStyle& style : tail.palette) {
    const Result<ShellStyle> checked = check_style(style, limits);
    if (!checked) return within("points", checked.error());
    const auto found = std::find(set->styles.begin(), set->styles.end(), *checked);
    united.push_back(static_cast<std::uint32_t>(found - set->styles.begin()));
    if (found == set->styles.end()) set->styles.push_back(*checked);
  }
  if (set->styles.size() > codec_limits.max_styles) {
    return too_many("points.palette", set->styles.size(), codec_limits.max_styles);
  }
  for (std::size_t i = 0; i < tail.positions.size(); ++i) {
    set->points.push_back({to_float(tail.positions[i]), united[tail.styles[i]]});
  }
  return std::shared_ptr<const PointSet>(std::move(set));
}

/// The mesh of `message`; one that leaves out its triangles has those of `held` (null: none).
Result<std::shared_ptr<const SurfaceMesh>> read_surface(const SurfaceMesh* held, const v1::Mesh& message,
                                                        const MirrorLimits& limits) {
  codec::MeshLimits codec_limits;
  codec_limits.max_vertices = std::min(codec_limits.max_vertices, limits.max_vertices);
  codec_limits.max_coordinate_m = limits.max_coordinate_m;
  codec::KnownTriangles known;
  if (held != nullptr) known = {held->topology, held->indices};
  Result<codec::MeshData> decoded = codec::decode_mesh(message, codec_limits, known);
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
  mesh->topology = message.topology();
  return std::shared_ptr<const SurfaceMesh>(std::move(mesh));
}

Result<std::shared_ptr<const std::vector<SceneCurve>>> read_curves(const v1::EntityState& state,
                                                                   const MirrorLimits& limits) {
  if (state.curves().empty()) return std::shared_ptr<const std::vector<SceneCurve>>();
  auto curves = std::make_shared<std::vector<SceneCurve>>();
  std::size_t total = 0;
  for (const v1::Polyline& line : state.curves()) {
    Result<SceneCurve> curve = read_curve(line, {limits.max_curve_points - total, limits.max_coordinate_m});
    if (!curve) return within("curves", curve.error());
    total += curve->points.size();
    curves->push_back(std::move(*curve));
  }
  return std::shared_ptr<const std::vector<SceneCurve>>(std::move(curves));
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
Status read_surface_state(const v1::EntityState& state, const MirrorLimits& limits, Entity& entity) {
  const bool surface_comes = state.surface_shown() && state.has_surface();
  if (!surface_comes && !state.distances().empty()) {
    return corrupt("distances", "came without the surface that they belong to");
  }
  if (!state.surface_shown()) {
    entity.surface = nullptr;
    entity.distances_m = nullptr;
  }
  if (!surface_comes) return {};
  Result<std::shared_ptr<const SurfaceMesh>> surface =
      read_surface(entity.surface.get(), state.surface(), limits);
  if (!surface) return surface.error();
  entity.surface = std::move(*surface);
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
      read_icons(state.icons(), {.max_icons = limits.max_icons,
                                 .max_outline_points = limits.max_curve_points,
                                 .max_text_bytes = limits.max_text_bytes,
                                 .max_coordinate_m = limits.max_coordinate_m});
  if (!icons) return icons.error();
  if (!state.icons_shown()) return {};
  entity.icons = icons->empty() ? nullptr : std::make_shared<const std::vector<SceneIcon>>(std::move(*icons));
  return {};
}

/// The entity after `state`, given the one held before (null: none).
Result<std::shared_ptr<const Entity>> read_entity(const Entity* held, const v1::EntityState& state,
                                                  const MirrorLimits& limits) {
  if (state.id().empty() || state.id().size() > limits.max_text_bytes) {
    return corrupt("id",
                   fmt::format("found {} bytes, expected 1..{}", state.id().size(), limits.max_text_bytes));
  }
  if (state.name().size() > limits.max_text_bytes) {
    return corrupt("name", fmt::format("found {} bytes, expected at most {}", state.name().size(),
                                       limits.max_text_bytes));
  }
  auto entity = held == nullptr ? std::make_shared<Entity>() : std::make_shared<Entity>(*held);
  entity->id = state.id();
  entity->name = state.name().empty() ? state.id() : state.name();
  const Result<EntityKind> kind = read_kind(state.kind());
  if (!kind) return kind.error();
  entity->kind = *kind;
  entity->revision = state.revision();
  entity->provisional = state.provisional();
  entity->selected = state.selected();
  entity->target = state.target();
  const Result<Representation> representation = read_representation(state.representation());
  if (!representation) return representation.error();
  entity->representation = *representation;
  if (!std::isfinite(state.residual_rms_m())) return corrupt("residual_rms_m", "expected a finite number");
  entity->residual_rms_m = state.residual_rms_m();
  if (state.has_points()) {
    Result<std::shared_ptr<const PointSet>> points =
        merge_points(held == nullptr ? nullptr : held->points.get(), state.points(), limits);
    if (!points) return points.error();
    entity->points = std::move(*points);
  }
  const std::size_t count = entity->points == nullptr ? 0 : entity->points->points.size();
  const std::size_t settled =
      state.provisional() ? std::min<std::size_t>(entity->settled_points, count) : count;
  entity->settled_points = static_cast<std::uint32_t>(settled);
  if (const Status surface = read_surface_state(state, limits, *entity); !surface) return surface.error();
  Result<std::shared_ptr<const std::vector<SceneCurve>>> curves = read_curves(state, limits);
  if (!curves) return curves.error();
  if (state.curves_shown()) entity->curves = std::move(*curves);
  if (const Status icons = read_icon_state(state, limits, *entity); !icons) return icons.error();
  return std::shared_ptr<const Entity>(std::move(entity));
}

Result<History> read_history(const v1::HistoryState& state, const MirrorLimits& limits) {
  if (state.next_undo().size() > limits.max_text_bytes || state.next_redo().size() > limits.max_text_bytes) {
    return corrupt("history",
                   fmt::format("expected descriptions of at most {} bytes", limits.max_text_bytes));
  }
  return History{state.undo_steps(), state.redo_steps(), state.next_undo(), state.next_redo()};
}

Result<Alternatives> read_alternatives(const v1::AlternativesState& state, const MirrorLimits& limits) {
  const auto count = static_cast<std::size_t>(state.names_size());
  if (count > limits.max_alternatives) return too_many("alternatives.names", count, limits.max_alternatives);
  Alternatives alternatives{state.present(), {}};
  bool present_is_one = count == 0 && state.present().empty();
  for (const std::string& name : state.names()) {
    if (name.size() > limits.max_text_bytes) {
      return corrupt("alternatives.names",
                     fmt::format("found {} bytes, expected at most {}", name.size(), limits.max_text_bytes));
    }
    present_is_one = present_is_one || name == state.present();
    alternatives.names.push_back(name);
  }
  if (!present_is_one) return corrupt("alternatives.present", "expected one of the names");
  return alternatives;
}

Status check_totals(const Scene& scene, const MirrorLimits& limits) {
  if (scene.entities.size() > limits.max_entities) {
    return too_many("entities", scene.entities.size(), limits.max_entities);
  }
  std::size_t points = 0;
  std::size_t vertices = 0;
  for (const auto& [id, entity] : scene.entities) {
    points += entity->points == nullptr ? 0 : entity->points->points.size();
    vertices += entity->surface == nullptr ? 0 : entity->surface->vertices.size();
  }
  if (points > limits.max_points) return too_many("points", points, limits.max_points);
  if (vertices > limits.max_vertices) return too_many("vertices", vertices, limits.max_vertices);
  return {};
}

}  // namespace

Result<Scene> SceneMirror::after(const v1::SceneSnapshot& snapshot) const {
  const auto count = static_cast<std::size_t>(snapshot.entities_size());
  if (count > limits_.max_entities) return too_many("entities", count, limits_.max_entities);
  Scene next;
  next.epoch = snapshot.epoch();
  next.sequence = snapshot.sequence();
  for (const v1::EntityState& state : snapshot.entities()) {
    Result<std::shared_ptr<const Entity>> entity = read_entity(nullptr, state, limits_);
    if (!entity) return within(fmt::format("entities[{}]", next.entities.size()), entity.error());
    if (!next.entities.emplace(state.id(), std::move(*entity)).second) {
      return corrupt("entities", fmt::format("'{}' comes twice", state.id()));
    }
    if (const Status fits = check_totals(next, limits_); !fits) return fits.error();
  }
  Result<History> history = read_history(snapshot.history(), limits_);
  if (!history) return history.error();
  next.history = std::move(*history);
  Result<Alternatives> alternatives = read_alternatives(snapshot.alternatives(), limits_);
  if (!alternatives) return alternatives.error();
  next.alternatives = std::move(*alternatives);
  return next;
}

Result<Scene> SceneMirror::after(const v1::SceneDelta& delta) {
  if (!begun_) return make_error(ErrorCode::failed_precondition, "a delta came before the first snapshot");
  if (delta.epoch() != scene_->epoch || delta.sequence() < scene_->sequence) {
    return make_error(ErrorCode::failed_precondition,
                      fmt::format("a delta of epoch {}, sequence {} does not follow epoch {}, sequence {}",
                                  delta.epoch(), delta.sequence(), scene_->epoch, scene_->sequence),
                      "sequence");
  }
  const auto count = static_cast<std::size_t>(delta.changed_size());
  if (count > limits_.max_entities) return too_many("changed", count, limits_.max_entities);
  Scene next = *scene_;
  next.sequence = delta.sequence();
  for (const std::string& id : delta.removed()) next.entities.erase(id);
  std::uint64_t stale = 0;
  for (int i = 0; i < delta.changed_size(); ++i) {
    const v1::EntityState& state = delta.changed(i);
    const auto found = next.entities.find(state.id());
    const Entity* held = found == next.entities.end() ? nullptr : found->second.get();
    if (held != nullptr && state.revision() < held->revision) {
      ++stale;
      continue;
    }
    Result<std::shared_ptr<const Entity>> entity = read_entity(held, state, limits_);
    if (!entity) return within(fmt::format("changed[{}]", i), entity.error());
    next.entities[state.id()] = std::move(*entity);
    if (const Status fits = check_totals(next, limits_); !fits) return fits.error();
  }
  if (delta.has_history()) {
    Result<History> history = read_history(delta.history(), limits_);
    if (!history) return history.error();
    next.history = std::move(*history);
  }
  if (delta.has_alternatives()) {
    Result<Alternatives> alternatives = read_alternatives(delta.alternatives(), limits_);
    if (!alternatives) return alternatives.error();
    next.alternatives = std::move(*alternatives);
  }
  statistics_.stale_entities += stale;
  return next;
}

Status SceneMirror::count(Result<Scene> next) {
  if (!next) {
    ++statistics_.refused;
    return next.error();
  }
  ++statistics_.applied;
  begun_ = true;
  scene_ = std::make_shared<const Scene>(std::move(*next));
  return {};
}

Status SceneMirror::apply(const v1::SceneSnapshot& snapshot) {
  return count(after(snapshot));
}
Status SceneMirror::apply(const v1::SceneDelta& delta) {
  return count(after(delta));
}

}  // namespace handloft::client
