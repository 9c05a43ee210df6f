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

constexpr std::uint32_t stored_version = 3;

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

void write_motion(const Similarity& motion, v1::StoredMotion& to) {
  to.set_scale(motion.scale);
  to.mutable_rotation()->set_w(motion.rotation.w());
  to.mutable_rotation()->set_x(motion.rotation.x());
  to.mutable_rotation()->set_y(motion.rotation.y());
  to.mutable_rotation()->set_z(motion.rotation.z());
  write_vector(motion.shift, *to.mutable_shift());
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

  Result<std::string> encode(const KeptState& state) {
    const History::Kept& history = state.history;
    measure_chunks(history.current);
    for (const auto& step : history.steps) measure_chunks(step.entry.step->delta);

    message_.set_version(stored_version);
    message_.set_sequence(state.sequence);
    write_document(history.current, *message_.mutable_current());
    for (const auto& step : history.steps) {
      const StepInfo& info = step.entry.step->info;
      v1::StoredStep& out = *message_.add_steps();
      write_delta(step.entry.step->delta, *out.mutable_delta());
      out.set_words(info.words);
      out.set_client_id(info.client_id);
      out.set_client_op_id(info.client_op_id);
      out.set_author(info.author);
      out.set_made_ns(info.made_ns);
      out.set_sequence(info.sequence);
      out.set_undone(step.entry.undone);
      out.set_number(step.number);
    }
    write_gone(history, *message_.mutable_gone());
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
    for (const auto& [name, version] : *document.versions) measure_chunks(*version->entities);
  }

  void measure_chunks(const StepDelta& delta) {
    for (const auto& change : delta.entities) {
      measure_chunks(change.before);
      measure_chunks(change.after);
    }
    for (const auto* wholes : {&delta.made, &delta.deleted}) {
      for (const StepDelta::Whole& whole : *wholes) measure_chunks(*whole.alternative.entities);
    }
    for (const auto& change : delta.versions) {
      for (const VersionPtr& version : {change.before, change.after}) {
        if (version) measure_chunks(*version->entities);
      }
    }
  }

  void measure_chunks(const Document::Entities& entities) {
    if (!measured_.insert(&entities).second) return;
    for (const auto& [id, entity] : entities) measure_chunks(entity);
  }

  void measure_chunks(const EntityPtr& entity) {
    if (!entity || !measured_.insert(entity.get()).second) return;
    const DualPtr shape = as_dual(entity);
    for (std::size_t c = 0; shape && c < shape->points.chunk_count(); ++c) {
      const auto points = shape->points.chunk(c);
      std::size_t& most = chunk_points_[points.data()];
      most = std::max(most, points.size());
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
    if (entity->motion) write_motion(*entity->motion, *out.mutable_motion());
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

  // --- the document, and steps by what they changed

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

  std::uint32_t place_of(const EntityPtr& one) { return entity(one); }

  std::uint32_t place_of(const VersionPtr& version) {
    const auto found = versions_.find(version.get());
    if (found != versions_.end()) return found->second;
    v1::StoredVersion out;
    out.set_name(version->name);
    out.set_note(version->note);
    out.set_author(version->author);
    out.set_made_ns(version->made_ns);
    out.set_alternative(version->alternative);
    out.set_sequence(version->sequence);
    out.set_parent(version->parent);
    out.set_set(entity_set(version->entities));
    const auto place = static_cast<std::uint32_t>(message_.versions_size());
    *message_.add_versions() = std::move(out);
    versions_.emplace(version.get(), place);
    return place;
  }

  std::uint32_t place_of(const CommentPtr& comment) {
    const auto found = comments_.find(comment.get());
    if (found != comments_.end()) return found->second;
    const auto place = static_cast<std::uint32_t>(message_.comments_size());
    v1::StoredComment& out = *message_.add_comments();
    out.set_id(comment->id);
    out.set_text(comment->text);
    out.set_entity(comment->entity);
    write_vector(comment->place, *out.mutable_place());
    if (comment->motion) write_motion(*comment->motion, *out.mutable_motion());
    out.set_reply_to(comment->reply_to);
    out.set_resolved(comment->resolved);
    out.set_author(comment->author);
    out.set_client_id(comment->client_id);
    out.set_made_ns(comment->made_ns);
    out.set_changed_ns(comment->changed_ns);
    out.set_number(comment->number);
    comments_.emplace(comment.get(), place);
    return place;
  }

  void write_document(const Document& document, v1::StoredDocument& out) {
    for (const auto& [id, one] : document.entities) out.add_entities(entity(one));
    for (const std::string& id : *document.used_ids) out.add_used_ids(id);
    out.set_next_shape(document.next_shape);
    out.set_present(document.present);
    out.set_has_alternatives(true);
    for (const Alternative& alternative : *document.alternatives) {
      v1::StoredAlternative& to = *out.add_alternatives();
      to.set_name(alternative.name);
      if (alternative.entities) to.set_set(entity_set(alternative.entities));
      to.set_version(alternative.version);
    }
    for (const auto& [name, version] : *document.versions) out.add_versions(place_of(version));
    for (const auto& [id, comment] : *document.comments) out.add_comments(place_of(comment));
    out.set_next_comment(document.next_comment);
  }

  template <typename Changes>
  void write_changes(const Changes& changes, google::protobuf::RepeatedPtrField<v1::StoredChange>& to) {
    for (const auto& change : changes) {
      v1::StoredChange& out = *to.Add();
      out.set_id(change.id);
      if (change.before) out.set_before(place_of(change.before));
      if (change.after) out.set_after(place_of(change.after));
    }
  }

  void write_wholes(const std::vector<StepDelta::Whole>& wholes,
                    google::protobuf::RepeatedPtrField<v1::StoredWhole>& to) {
    for (const StepDelta::Whole& whole : wholes) {
      v1::StoredWhole& out = *to.Add();
      out.set_place(whole.place);
      out.set_name(whole.alternative.name);
      out.set_set(entity_set(whole.alternative.entities));
      out.set_version(whole.alternative.version);
    }
  }

  void write_delta(const StepDelta& delta, v1::StoredDelta& out) {
    out.set_alternative(delta.alternative);
    write_changes(delta.entities, *out.mutable_entities());
    write_wholes(delta.made, *out.mutable_made());
    write_wholes(delta.deleted, *out.mutable_deleted());
    out.set_present_before(delta.present_before);
    out.set_present_after(delta.present_after);
    for (const StepDelta::At& at : delta.at) {
      v1::StoredAt& to = *out.add_at();
      to.set_alternative(at.alternative);
      to.set_before(at.before);
      to.set_after(at.after);
    }
    write_changes(delta.versions, *out.mutable_versions());
    write_changes(delta.comments, *out.mutable_comments());
    for (const std::string& id : delta.ids) out.add_ids(id);
    out.set_next_shape_before(delta.next_shape_before);
    out.set_next_shape_after(delta.next_shape_after);
    out.set_next_comment_before(delta.next_comment_before);
    out.set_next_comment_after(delta.next_comment_after);
  }

  static void write_gone(const History::Kept& history, v1::StoredGone& out) {
    out.set_last_step(history.last_step);
    out.set_early_steps(history.early);
    out.mutable_newest()->set_client_id(history.newest.client_id);
    out.mutable_newest()->set_step(history.newest.number);
    out.mutable_before()->set_client_id(history.before.client_id);
    out.mutable_before()->set_step(history.before.number);
    for (const History::Kept::Gone& gone : history.gone) {
      v1::StoredGoneOf& to = *out.add_clients();
      to.set_client_id(gone.client_id);
      to.set_older(gone.older);
      to.set_newer(gone.newer);
      to.set_given_shape(gone.highest.shape);
      to.set_given_comment(gone.highest.comment);
    }
    for (const auto& [key, number] : history.forgotten) {
      v1::StoredTouch& to = *out.add_touched();
      to.set_key(key);
      to.set_step(number);
    }
    out.set_given_shape(history.forgotten_highest.shape);
    out.set_given_comment(history.forgotten_highest.comment);
    out.set_sequence(history.forgotten_sequence);
  }

  const TakePart& take_;
  const EncodeOptions& options_;
  Status taken_;
  v1::StoredModel message_;
  std::unordered_map<const void*, std::uint32_t> parts_;
  std::unordered_map<const void*, std::uint32_t> entities_;
  std::unordered_map<const void*, std::uint32_t> sets_;
  std::unordered_map<const void*, std::uint32_t> versions_;
  std::unordered_map<const void*, std::uint32_t> comments_;
  std::unordered_map<const void*, std::size_t> chunk_points_;
  std::set<const void*> measured_;
};

}  // namespace

Result<std::string> encode_state(const KeptState& state, const TakePart& take, const EncodeOptions& options) {
  return Encoder(take, options).encode(state);
}

Result<std::string> encode_state(const StoredState& state, const TakePart& take,
                                 const EncodeOptions& options) {
  return encode_state(KeptState{state.history.kept(options.max_steps), state.sequence}, take, options);
}

}  // namespace handloft::model
