#include "server-model/stream/viewer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "common/codec/mesh_codec.h"
#include "common/codec/point_codec.h"
#include "server-model/geometry/fuzzy_point.h"
#include "server-model/model/cad_model.h"
#include "server-model/model/reference_shape.h"
#include "server-model/model/sculpt_shape.h"
#include "server-model/stream/curves.h"
#include "server-model/stream/icons.h"

namespace handloft::stream {
namespace {

/// The glove knows 1024 levels of pressure (A1), so quantising styles to them costs nothing.
constexpr double pressure_levels = 1023.0;

/// What an entity's state takes besides its points and mesh: names, flags, tags.
constexpr std::size_t entity_overhead_bytes = 512;
constexpr std::size_t icon_overhead_bytes = 128;

codec::FuzzyStyle style_of(std::uint32_t level) {
  codec::FuzzyStyle style;
  style.pressure = level / pressure_levels;
  style.radius_m = static_cast<float>(geometry::fuzzy_radius(style.pressure));
  const auto shells = geometry::fuzzy_shells(style.pressure);
  for (std::size_t k = 0; k < shells.size(); ++k) {
    style.shell_radius_m[k] = static_cast<float>(shells[k].radius_m);
    style.shell_alpha[k] = static_cast<float>(shells[k].alpha);
  }
  return style;
}

bool looks_alike(const model::DualPoint& a, const model::DualPoint& b) {
  return a.x == b.x && a.y == b.y && a.z == b.z && a.pressure == b.pressure;
}

v1::Representation to_proto(model::Representation representation) {
  switch (representation) {
    case model::Representation::points:
      return v1::REPRESENTATION_POINTS;
    case model::Representation::surface:
      return v1::REPRESENTATION_SURFACE;
    case model::Representation::both:
      return v1::REPRESENTATION_BOTH;
  }
  return v1::REPRESENTATION_UNSPECIFIED;
}

bool same(const v1::HistoryState& a, const v1::HistoryState& b) {
  return a.undo_steps() == b.undo_steps() && a.redo_steps() == b.redo_steps() &&
         a.next_undo() == b.next_undo() && a.next_redo() == b.next_redo() &&
         a.undo_refused() == b.undo_refused() && a.redo_refused() == b.redo_refused();
}

bool same(const v1::StorageState& a, const v1::StorageState& b) {
  return a.kept() == b.kept() && a.durable_sequence() == b.durable_sequence() && a.problem() == b.problem();
}

bool same(const v1::AlternativesState& a, const v1::AlternativesState& b) {
  return a.present() == b.present() &&
         std::equal(a.names().begin(), a.names().end(), b.names().begin(), b.names().end());
}

}  // namespace

std::size_t common_prefix(const model::PointCloud& a, const model::PointCloud& b) {
  const std::size_t chunks = std::min(a.chunk_count(), b.chunk_count());
  std::size_t prefix = 0;
  for (std::size_t i = 0; i < chunks; ++i) {
    const auto left = a.chunk(i);
    const auto right = b.chunk(i);
    const std::size_t shared = std::min(left.size(), right.size());
    if (left.data() != right.data()) {
      for (std::size_t k = 0; k < shared; ++k) {
        if (!looks_alike(left[k], right[k])) return prefix + k;
      }
    }
    prefix += shared;
  }
  return prefix;
}

Result<v1::PointCloud> pack_points(const model::PointCloud& points, std::size_t first, std::size_t end) {
  codec::PointTail tail;
  tail.first = static_cast<std::uint32_t>(first);
  tail.total = static_cast<std::uint32_t>(end);
  tail.positions.reserve(end - first);
  tail.styles.reserve(end - first);
  constexpr std::uint16_t unused = std::numeric_limits<std::uint16_t>::max();
  constexpr auto last_level = static_cast<std::uint32_t>(pressure_levels);
  std::vector<std::uint16_t> style_of_level(last_level + 1, unused);
  double reach_m = 0.0;
  const auto add = [&](const model::DualPoint& point) {
    tail.positions.push_back({point.x, point.y, point.z});
    reach_m = std::max({reach_m, std::abs(point.x), std::abs(point.y), std::abs(point.z)});
    // Never negative, and lround() would be a call for each point.
    // NOLINTNEXTLINE(bugprone-incorrect-roundings)
    const auto nearest = static_cast<std::uint32_t>(point.pressure * pressure_levels + 0.5);
    const auto level = std::min(last_level, nearest);
    std::uint16_t& style = style_of_level[level];
    if (style == unused) {
      style = static_cast<std::uint16_t>(tail.palette.size());
      tail.palette.push_back(style_of(level));
    }
    tail.styles.push_back(style);
  };
  std::size_t begin = 0;  // Of a chunk.
  for (std::size_t i = 0; i < points.chunk_count() && begin < end; ++i) {
    const auto chunk = points.chunk(i);
    const std::size_t last = std::min(end - begin, chunk.size());
    for (std::size_t k = first > begin ? first - begin : 0; k < last; ++k) add(chunk[k]);
    begin += chunk.size();
  }
  // A micrometre, unless the points lie kilometres away.
  codec::PointCodecOptions options;
  options.step_m = std::max(options.step_m, reach_m / std::numeric_limits<std::int32_t>::max());
  return codec::encode_points(tail, options);
}

void Viewer::reset() {
  begun_ = false;
  told_ = false;
  held_.clear();
  comments_ = nullptr;
  versions_ = nullptr;
}

bool Viewer::can_resume(const v1::Join& join, const Scene& scene) const {
  return join.epoch() != 0 && join.epoch() == scene.epoch &&
         static_cast<std::size_t>(join.have_size()) <= limits_.max_held;
}

bool Viewer::resume(const v1::Join& join, const Scene& scene) {
  reset();
  if (!can_resume(join, scene)) return false;
  for (const v1::HeldEntity& have : join.have()) {
    Held& held = held_[have.id()];  // Also of what is gone by now: so it is told.
    held = Held();
    const auto found = scene.entities.find(have.id());
    if (found == scene.entities.end()) continue;
    const SceneEntity& entity = found->second;
    const model::DualPtr shape = model::as_dual(entity.entity);
    const std::size_t points = shape ? shape->points.size() : 0;
    if (entity.revision == have.revision() && have.points() <= points) {
      held.entity = entity;
      held.unsure = true;
      held.points = have.points();
    } else {
      held.unknown = true;
      // Of a cloud that has only grown since, the tail will do.
      if (shape && have.revision() < entity.revision && have.revision() >= entity.points_grow_since &&
          have.points() <= points) {
        held.entity.entity = entity.entity;
        held.points = have.points();
      }
    }
    if (have.surface_id() != 0 && have.surface_id() == entity.surface_id) {
      held.surface = entity.surface;
      held.distances = entity.distances;
    }
  }
  begun_ = true;
  return true;
}

namespace {

/// Of what `held` has and `now` (maybe null) has not: chunks of points are shared with what came of them.
std::size_t bytes_beside(const model::EntityPtr& held, const model::EntityPtr& now) {
  constexpr std::size_t per_icon = 256;
  if (held == now) return 0;
  const model::SculptPtr sculpted = model::as_sculpt(held);
  if (sculpted) return sculpted->icons->size() * per_icon;
  const model::DualPtr shape = model::as_dual(held);
  if (!shape) return 0;
  const model::DualPtr newer = model::as_dual(now);
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < shape->points.chunk_count(); ++i) {
    const auto chunk = shape->points.chunk(i);
    const bool shared =
        newer && i < newer->points.chunk_count() && newer->points.chunk(i).data() == chunk.data();
    if (!shared) bytes += chunk.size() * sizeof(model::DualPoint);
  }
  return bytes;
}

std::size_t bytes_of(const v1::Mesh& mesh) {
  return mesh.positions().size() + mesh.normals().size() + mesh.opacity().size() + mesh.indices().size() +
         mesh.residuals().size();
}

}  // namespace

bool Viewer::has_been_told(const v1::StorageState& storage) const {
  return told_ && same(own_.storage, storage);
}

std::size_t Viewer::stale_bytes(const Scene& scene) const {
  std::size_t bytes = 0;
  for (const auto& [id, held] : held_) {
    const auto found = scene.entities.find(id);
    const SceneEntity* now = found == scene.entities.end() ? nullptr : &found->second;
    if (held.entity.entity) bytes += bytes_beside(held.entity.entity, now == nullptr ? nullptr : now->entity);
    for (const auto& surface : {held.surface, held.entity.surface}) {
      if (surface && (now == nullptr || now->surface != surface)) bytes += bytes_of(*surface);
      if (held.surface == held.entity.surface) break;  // One and the same.
    }
    if (held.distances && (now == nullptr || now->distances != held.distances))
      bytes += held.distances->size();
  }
  return bytes;
}

namespace {

void copy_without_triangles(const v1::Mesh& from, v1::Mesh& to) {
  to.set_vertex_count(from.vertex_count());
  to.set_index_count(from.index_count());
  *to.mutable_origin() = from.origin();
  to.set_step_m(from.step_m());
  to.set_positions(from.positions());
  to.set_normals(from.normals());
  to.set_opacity(from.opacity());
  to.set_topology(from.topology());
  to.set_row(from.row());
  to.set_residuals(from.residuals());
}

}  // namespace

bool Viewer::is_current(const Held& held, const SceneEntity& entity) const {
  const bool surface_current =
      !entity.surface || (held.surface == entity.surface && held.distances == entity.distances);
  const model::DualPtr shape = model::as_dual(entity.entity);
  const std::size_t points = shape ? shape->points.size() : 0;
  return !held.unsure && !held.unknown && surface_current && held.points == points &&
         held.entity.entity == entity.entity && held.entity.revision == entity.revision &&
         held.entity.provisional == entity.provisional &&
         held.entity.provisional_by == entity.provisional_by && held.entity.selected == entity.selected &&
         held.entity.target == entity.target && held.entity.icon_marks == entity.icon_marks &&
         held.entity.lease == entity.lease;
}

void Viewer::update(Held& held, const std::string& id, const SceneEntity& entity,
                    v1::EntityState& state) const {
  state.set_id(id);
  state.set_kind(std::string(model::to_string(entity.entity->kind())));
  state.set_revision(entity.revision);
  state.set_name(entity.entity->name);
  state.set_provisional(entity.provisional);
  state.set_provisional_by(entity.provisional_by);
  state.set_selected(entity.selected);
  state.set_target(entity.target);
  state.set_leased_by(entity.lease.client_id);
  state.set_leased_by_name(entity.lease.name);
  if (const model::DualPtr shape = model::as_dual(entity.entity)) update_dual(held, shape, entity, state);
  const model::SculptPtr sculpted = model::as_sculpt(entity.entity);
  const model::CadModelPtr cad = model::as_cad_model(entity.entity);
  if (sculpted && (held.unsure || held.unknown || icons_differ(held.entity, entity)))
    write_icons(entity, state);
  if (sculpted || (cad && cad->rest) || model::as_reference(entity.entity)) {
    state.set_representation(v1::REPRESENTATION_SURFACE);
    state.set_surface_shown(true);
    update_surface(held, entity, state);
  }
  held.entity = entity;
  held.unsure = held.unknown = false;
}

void Viewer::update_surface(Held& held, const SceneEntity& entity, v1::EntityState& state) const {
  if (!entity.surface) return;
  if (held.surface == entity.surface && held.distances == entity.distances) return;
  // Of a surface that is dragged, the viewer has the triangles: two thirds of the work for both.
  const bool same_triangles = held.surface && entity.surface->topology() != 0 &&
                              held.surface->topology() == entity.surface->topology();
  // What the server itself has packed can be unpacked, for readers of vertex streams.
  const bool as_streams = reading_ == MeshReading::vertex_streams;
  if (as_streams && packs_ && !same_triangles) {
    const auto plain = packs_->vertex_streams(entity.surface);
    *state.mutable_surface() = plain ? **plain : *entity.surface;
  } else {
    if (same_triangles) {
      copy_without_triangles(*entity.surface, *state.mutable_surface());
    } else {
      *state.mutable_surface() = *entity.surface;
    }
    if (as_streams) {
      if (auto plain = codec::as_vertex_streams(state.surface()))
        *state.mutable_surface() = *std::move(plain);
    }
  }
  if (entity.distances) state.set_distances(*entity.distances);
  state.set_surface_id(entity.surface_id);
  held.surface = entity.surface;
  held.distances = entity.distances;
}

void Viewer::update_dual(Held& held, const model::DualPtr& now, const SceneEntity& entity,
                         v1::EntityState& state) const {
  const model::DualShape& shape = *now;
  state.set_representation(to_proto(shape.representation));
  state.set_surface_shown(shape.fitted());
  if (shape.fit) state.set_residual_rms_m(shape.fit->statistics.rms);

  const model::DualPtr before = model::as_dual(held.entity.entity);
  const std::size_t common = before ? std::min(held.points, common_prefix(before->points, shape.points)) : 0;
  const std::size_t end = std::min(shape.points.size(), common + limits_.max_points_per_message);
  if ((held.unknown && !before) || common != held.points || end != common) {
    // The model's limits keep every point within the codec's reach.
    if (packs_) {
      if (const auto packed = packs_->points(now, common, end)) *state.mutable_points() = **packed;
    } else if (auto packed = pack_points(shape.points, common, end)) {
      *state.mutable_points() = *std::move(packed);
    }
  }
  held.points = end;
  if (held.unknown || curves_differ(before.get(), shape)) write_curves(shape, state);
  if (!shape.fitted()) {
    held.surface = nullptr;
    held.distances = nullptr;
  } else {
    update_surface(held, entity, state);
  }
}

std::optional<v1::Envelope> Viewer::next(const Scene& scene, const Personal& own) {
  v1::Envelope envelope;
  std::size_t bytes = 0;
  const auto add_changed = [&](auto& list) {
    for (const auto& [id, entity] : scene.entities) {
      if (bytes >= limits_.max_message_bytes) return;  // the rest follows
      Held& held = held_[id];
      if (held.entity.entity && is_current(held, entity)) continue;
      v1::EntityState& state = *list.Add();
      update(held, id, entity, state);
      bytes += entity_overhead_bytes + state.points().positions().size() + state.points().styles().size() +
               bytes_of(state.surface()) + state.distances().size();
      for (const v1::Polyline& curve : state.curves()) bytes += curve.points().size();
      for (const v1::Icon& icon : state.icons()) bytes += icon_overhead_bytes + icon.outline().size();
    }
  };

  if (!begun_) {
    v1::SceneSnapshot& snapshot = *envelope.mutable_snapshot();
    snapshot.set_epoch(scene.epoch);
    snapshot.set_sequence(scene.sequence);
    *snapshot.mutable_history() = own.history;
    *snapshot.mutable_storage() = own.storage;
    *snapshot.mutable_alternatives() = scene.alternatives;
    *snapshot.mutable_comments() = *scene.comments;
    *snapshot.mutable_versions() = *scene.versions;
    add_changed(*snapshot.mutable_entities());
  } else {
    v1::SceneDelta& delta = *envelope.mutable_delta();
    delta.set_epoch(scene.epoch);
    delta.set_sequence(scene.sequence);
    delta.set_capture_time_ns(scene.capture_time_ns);
    *delta.mutable_history() = own.history;
    bool current = told_ && sequence_ == scene.sequence && same(own_.history, own.history);
    if (!told_ || !same(own_.storage, own.storage)) {
      *delta.mutable_storage() = own.storage;
      current = false;
    }
    if (!told_ || !same(alternatives_, scene.alternatives)) {
      *delta.mutable_alternatives() = scene.alternatives;
      current = false;
    }
    if (!told_ || comments_ != scene.comments) {
      *delta.mutable_comments() = *scene.comments;
      current = false;
    }
    if (!told_ || versions_ != scene.versions) {
      *delta.mutable_versions() = *scene.versions;
      current = false;
    }
    for (auto held = held_.begin(); held != held_.end();) {
      const bool gone = !scene.entities.contains(held->first);
      if (gone) delta.add_removed(held->first);
      held = gone ? held_.erase(held) : std::next(held);
    }
    add_changed(*delta.mutable_changed());
    if (current && delta.changed().empty() && delta.removed().empty()) return std::nullopt;
  }
  begun_ = true;
  told_ = true;
  sequence_ = scene.sequence;
  own_ = own;
  alternatives_ = scene.alternatives;
  comments_ = scene.comments;
  versions_ = scene.versions;
  return envelope;
}

}  // namespace handloft::stream
