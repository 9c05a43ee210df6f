#include <algorithm>
#include <map>
#include <memory>
#include <set>
#include <unordered_map>
#include <utility>

#include "proto/storage.pb.h"
#include "server-model/model/bspline_message.h"
#include "server-model/model/cad_model.h"
#include "server-model/model/content_hash.h"
#include "server-model/model/document_codec.h"
#include "server-model/model/reference_shape.h"
#include "server-model/model/sculpt_shape.h"
#include "server-model/model/vector_message.h"

namespace handloft::model {

namespace v1 = handloft::v1;

namespace {

using geometry::Vec3;

constexpr std::uint32_t stored_version = 1;

template <typename Numbers>
void add_vector(const Vec3& vector, Numbers& numbers) {
  for (const double coordinate : vector) numbers.Add(coordinate);
}

void add_box(const geometry::Box2& box, google::protobuf::RepeatedField<double>& numbers) {
  for (const double value : box.centre) numbers.Add(value);
  for (const double value : box.half_extent) numbers.Add(value);
}

v1::StoredVectors vectors_message(const std::vector<Vec3>& vectors) {
  v1::StoredVectors message;
  message.mutable_numbers()->Reserve(static_cast<int>(3 * vectors.size()));
  for (const Vec3& vector : vectors) add_vector(vector, *message.mutable_numbers());
  return message;
}

v1::TriangleMesh mesh_message(const ReferenceMesh& mesh) {
  v1::TriangleMesh message;
  for (const auto& position : mesh.positions)
    message.mutable_positions()->Add(position.begin(), position.end());
  for (const auto& triangle : mesh.triangles)
    message.mutable_indices()->Add(triangle.begin(), triangle.end());
  return message;
}

v1::StoredFit fit_message(const FittedSurface& fit) {
  v1::StoredFit message;
  write_vector(fit.frame.origin, *message.mutable_frame()->mutable_origin());
  write_vector(fit.frame.rotation.col(0), *message.mutable_frame()->mutable_x());
  write_vector(fit.frame.rotation.col(1), *message.mutable_frame()->mutable_y());
  write_vector(fit.frame.rotation.col(2), *message.mutable_frame()->mutable_z());
  message.set_degree(static_cast<std::uint32_t>(fit.surface.degree()));
  add_box(fit.surface.box(), *message.mutable_surface_box());
  const auto coefficients = fit.surface.scaled_coefficients();
  message.mutable_scaled_coefficients()->Add(coefficients.begin(), coefficients.end());
  message.set_requested_degree(fit.requested_degree);
  message.mutable_residuals_m()->Add(fit.residuals_m.begin(), fit.residuals_m.end());
  message.set_count(fit.statistics.count);
  message.set_rms(fit.statistics.rms);
  message.set_weighted_rms(fit.statistics.weighted_rms);
  message.set_max(fit.statistics.max);
  message.mutable_cross_validated_rms_m()->Add(fit.cross_validated_rms_m.begin(),
                                               fit.cross_validated_rms_m.end());
  add_box(fit.box, *message.mutable_footprint_box());
  message.set_frame_drift_rad(fit.frame_drift_rad);
  return message;
}

v1::StoredPoints points_message(std::span<const DualPoint> points) {
  v1::StoredPoints message;
  const int count = static_cast<int>(points.size());
  message.mutable_positions()->Reserve(3 * count);
  message.mutable_pressures()->Reserve(count);
  message.mutable_times_ns()->Reserve(count);
  message.mutable_strokes()->Reserve(count);
  message.mutable_partners()->Reserve(count);
  for (const DualPoint& point : points) {
    for (const double value : {point.x, point.y, point.z}) message.add_positions(value);
    message.add_pressures(point.pressure);
    message.add_times_ns(point.time_ns);
    message.add_strokes(point.stroke);
    message.add_partners(point.partner);
  }
  return message;
}

class Encoder {
 public:
  Encoder(const TakePart& take, const EncodeOptions& options) : take_(take), options_(options) {}

  Result<std::string> encode(const StoredState& state) {
    const History& history = state.history;
    const auto& steps = history.steps();
    const std::size_t position = history.undo_steps();
    const std::size_t first = position - std::min(position, options_.max_steps);
    const std::size_t end = position + std::min(steps.size() - position, options_.max_steps);
    const Document& base = first == 0 ? history.base() : steps[first - 1]->after;
    measure_chunks(base);
    for (std::size_t i = first; i < end; ++i) measure_chunks(steps[i]->after);

    message_.set_version(stored_version);
    message_.set_sequence(state.sequence);
    message_.set_position(position - first);
    const Document fresh;
    write_document(fresh, base, *message_.mutable_base());
    const Document* before = &base;
    for (std::size_t i = first; i < end; ++i) {
      const History::Step& step = *steps[i];
      v1::StoredStep& out = *message_.add_steps();
      write_document(*before, step.after, *out.mutable_after());
      out.set_words(step.words);
      out.set_client_id(step.client_id);
      out.set_client_op_id(step.client_op_id);
      before = &step.after;
    }
    if (!taken_) return taken_.error();
    return message_.SerializeAsString();
  }

 private:
  // --- parts, each once

  std::uint32_t add_part(const void* identity, std::string_view bytes) {
    const auto place = static_cast<std::uint32_t>(message_.parts_size());
    if (bytes.size() < options_.min_shared_bytes) {
      message_.add_parts()->set_inside(bytes.data(), bytes.size());
    } else {
      const ContentHash::Digest hash = content_hash(bytes);
      if (taken_) taken_ = take_(as_bytes(hash), bytes);
      message_.add_parts()->set_sha256(std::string(as_bytes(hash)));
    }
    if (identity != nullptr) parts_.emplace(identity, place);
    return place;
  }

  /// `make` is asked for its message only when the part is new.
  template <typename Make>
  std::uint32_t part(const void* identity, const Make& make) {
    const auto found = parts_.find(identity);
    return found != parts_.end() ? found->second : add_part(identity, make().SerializeAsString());
  }

  std::uint32_t surface_part(const std::shared_ptr<const geometry::BSplineSurface>& surface) {
    return part(surface.get(), [&] {
      v1::BSplineSurface message;
      write_surface(*surface, message);
      return message;
    });
  }

  // --- chunks of points: copies of a cloud share them, and see more or less of the last

  void measure_chunks(const Document& document) {
    measure_chunks(document.entities);
    for (const Alternative& alternative : *document.alternatives) {
      if (alternative.entities) measure_chunks(*alternative.entities);
    }
  }

  void measure_chunks(const Document::Entities& entities) {
    for (const auto& [id, entity] : entities) {
      if (!measured_.insert(entity.get()).second) continue;
      const DualPtr shape = as_dual(entity);
      for (std::size_t c = 0; shape && c < shape->points.chunk_count(); ++c) {
        const auto points = shape->points.chunk(c);
        std::size_t& most = chunk_points_[points.data()];
        most = std::max(most, points.size());
      }
    }
  }

  std::uint32_t chunk_part(std::span<const DualPoint> seen) {
    return part(seen.data(), [&] { return points_message({seen.data(), chunk_points_.at(seen.data())}); });
  }

  // --- entities, each once

  std::uint32_t entity(const EntityPtr& entity) {
    const auto found = entities_.find(entity.get());
    if (found != entities_.end()) return found->second;
    v1::StoredEntity out;
    out.set_id(entity->id);
    out.set_name(entity->name);
    if (const DualPtr shape = as_dual(entity)) {
      write_dual(*shape, *out.mutable_dual_shape());
    } else if (const ReferencePtr reference = as_reference(entity)) {
      out.set_reference(part(reference->mesh.get(), [&] { return mesh_message(*reference->mesh); }));
    } else if (const SculptPtr sculpted = as_sculpt(entity)) {
      write_sculpt(*sculpted, *out.mutable_sculpt_surface());
    } else if (const CadModelPtr model = as_cad_model(entity)) {
      write_model(*model, *out.mutable_cad_model());
    }
    const auto place = static_cast<std::uint32_t>(message_.entities_size());
    *message_.add_entities() = std::move(out);
    entities_.emplace(entity.get(), place);
    return place;
  }

  void write_dual(const DualShape& shape, v1::StoredDualShape& out) {
    out.set_requested_degree(shape.requested_degree);
    for (std::size_t c = 0; c < shape.points.chunk_count(); ++c)
      out.add_chunks(chunk_part(shape.points.chunk(c)));
    out.set_point_count(shape.points.size());
    out.set_stroke_count(shape.stroke_count);
    if (shape.fit) out.set_fit(part(shape.fit.get(), [&] { return fit_message(*shape.fit); }));
    out.set_stale(shape.stale);
    out.set_symmetry(static_cast<std::uint32_t>(shape.symmetry));
    write_vector(shape.plane.origin, *out.mutable_plane()->mutable_origin());
    write_vector(shape.plane.normal, *out.mutable_plane()->mutable_normal());
    out.set_linked_from(shape.linked_from);
    out.set_partner(shape.partner);
    out.set_superellipse_exponent(shape.superellipse_exponent);
    if (shape.boundary)
      out.set_boundary(part(shape.boundary.get(), [&] { return vectors_message(shape.boundary->points()); }));
    out.set_representation(static_cast<std::uint32_t>(shape.representation));
  }

  void write_icon(const SculptIcon& icon, v1::StoredIcon& out) {
    out.set_id(icon.id);
    out.set_shape(static_cast<std::uint32_t>(icon.shape));
    out.set_role(static_cast<std::uint32_t>(icon.role));
    out.set_property(static_cast<std::uint32_t>(icon.property));
    out.set_state(static_cast<std::uint32_t>(icon.state));
    out.set_outside(icon.outside);
    for (const geometry::Vec2& parameter : icon.parameters) {
      out.add_parameters(parameter.x());
      out.add_parameters(parameter.y());
    }
    out.set_stiffness(icon.stiffness);
    for (const std::string& sensor : icon.sensors) out.add_sensors(sensor);
    if (icon.reference)
      out.set_reference(part(icon.reference.get(), [&] { return vectors_message(*icon.reference); }));
    write_vector(icon.pivot, *out.mutable_pivot());
    write_vector(icon.translation, *out.mutable_translation());
    out.mutable_rotation()->set_w(icon.rotation.w());
    out.mutable_rotation()->set_x(icon.rotation.x());
    out.mutable_rotation()->set_y(icon.rotation.y());
    out.mutable_rotation()->set_z(icon.rotation.z());
    for (const IconBend& bend : icon.bends) {
      v1::StoredIconBend& to = *out.add_bends();
      to.set_held_at(bend.held_at);
      to.set_reach_m(bend.reach_m);
      write_vector(bend.translation, *to.mutable_translation());
    }
    write_vector(icon.place, *out.mutable_place());
  }

  void write_sculpt(const SculptShape& shape, v1::StoredSculptShape& out) {
    out.set_initial(surface_part(shape.initial));
    out.set_rest(surface_part(shape.rest));
    out.set_surface(surface_part(shape.surface));
    for (const SculptIcon& icon : *shape.icons) write_icon(icon, *out.add_icons());
    v1::SculptEnergy& energy = *out.mutable_energy();
    energy.set_a11(shape.energy.a11);
    energy.set_a12(shape.energy.a12);
    energy.set_a22(shape.energy.a22);
    energy.set_b11(shape.energy.b11);
    energy.set_b12(shape.energy.b12);
    energy.set_b22(shape.energy.b22);
    for (const geometry::Support support :
         {shape.supports.u_lower, shape.supports.u_upper, shape.supports.v_lower, shape.supports.v_upper}) {
      out.add_supports(static_cast<std::uint32_t>(support));
    }
    out.set_absolute(shape.absolute);
    out.set_least_squares(shape.least_squares);
    for (const IconRemark& remark : shape.remarks) {
      v1::StoredIconRemark& to = *out.add_remarks();
      to.set_icon(remark.icon);
      to.set_kind(static_cast<std::uint32_t>(remark.kind));
      to.set_off(remark.off);
    }
    if (shape.trim) {
      out.set_trim(part(shape.trim.get(), [&] {
        v1::StoredTrim message;
        write_trim(*shape.trim, *message.mutable_loops());
        return message;
      }));
    }
    out.set_model(shape.model);
    out.set_face(shape.face);
    out.set_reversed(shape.reversed);
  }

  void write_model(const CadModel& model, v1::StoredCadModel& out) {
    const auto found = parts_.find(model.boundary_representation.get());
    out.set_boundary_representation(found != parts_.end() ? found->second
                                                          : add_part(model.boundary_representation.get(),
                                                                     *model.boundary_representation));
    out.set_metres_per_unit(model.metres_per_unit);
    write_vector(model.translation, *out.mutable_translation());
    if (model.rest) out.set_rest(part(model.rest.get(), [&] { return mesh_message(*model.rest); }));
    for (const std::string& face : model.faces) out.add_faces(face);
  }

  // --- documents, each by what differs from the one before

  std::uint32_t entity_set(const std::shared_ptr<const Document::Entities>& entities) {
    const auto found = sets_.find(entities.get());
    if (found != sets_.end()) return found->second;
    v1::StoredEntitySet out;
    for (const auto& [id, one] : *entities) out.add_entities(entity(one));
    const auto place = static_cast<std::uint32_t>(message_.sets_size());
    *message_.add_sets() = std::move(out);
    sets_.emplace(entities.get(), place);
    return place;
  }

  void write_document(const Document& before, const Document& document, v1::StoredDocument& out) {
    const Changes changes = difference(before, document);
    for (const auto* ids : {&changes.created, &changes.changed}) {
      for (const std::string& id : *ids) out.add_entities(entity(document.find(id)));
    }
    for (const std::string& id : changes.removed) out.add_removed(id);
    if (before.used_ids != document.used_ids) {
      for (const std::string& id : *document.used_ids) {
        if (!before.used_ids->contains(id)) out.add_used_ids(id);
      }
      for (const std::string& id : *before.used_ids) {
        if (!document.used_ids->contains(id)) out.add_unused_ids(id);
      }
    }
    out.set_next_shape(document.next_shape);
    out.set_present(document.present);
    if (before.alternatives == document.alternatives) return;
    out.set_has_alternatives(true);
    for (const Alternative& alternative : *document.alternatives) {
      v1::StoredAlternative& to = *out.add_alternatives();
      to.set_name(alternative.name);
      if (alternative.entities) to.set_set(entity_set(alternative.entities));
    }
  }

  const TakePart& take_;
  const EncodeOptions& options_;
  Status taken_;
  v1::StoredModel message_;
  std::unordered_map<const void*, std::uint32_t> parts_;
  std::unordered_map<const void*, std::uint32_t> entities_;
  std::unordered_map<const void*, std::uint32_t> sets_;
  std::unordered_map<const void*, std::size_t> chunk_points_;
  std::set<const void*> measured_;
};

}  // namespace

Result<std::string> encode_state(const StoredState& state, const TakePart& take,
                                 const EncodeOptions& options) {
  return Encoder(take, options).encode(state);
}

}  // namespace handloft::model
