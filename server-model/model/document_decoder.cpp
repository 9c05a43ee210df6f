#include <fmt/format.h>

#include <limits>
#include <map>
#include <memory>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include "proto/storage.pb.h"
#include "server-model/model/bspline_message.h"
#include "server-model/model/cad_model.h"
#include "server-model/model/canonical.h"
#include "server-model/model/content_hash.h"
#include "server-model/model/document_codec.h"
#include "server-model/model/reference_shape.h"
#include "server-model/model/sculpt_shape.h"

namespace handloft::model {

namespace v1 = handloft::v1;

namespace {

using geometry::Vec2;
using geometry::Vec3;
using PointBlock = PointCloud::Block;

constexpr std::uint32_t newest_version = 3;

Error damaged(std::string message, std::string field) {
  return make_error(ErrorCode::data_corrupt, std::move(message), std::move(field));
}

Vec3 vector_of(const v1::Vec3& message) {
  return {message.x(), message.y(), message.z()};
}

Result<geometry::Box2> box_of(const google::protobuf::RepeatedField<double>& numbers,
                              const std::string& field) {
  if (numbers.size() != 4) return damaged(fmt::format("found {} numbers, expected 4", numbers.size()), field);
  return geometry::Box2{{numbers[0], numbers[1]}, {numbers[2], numbers[3]}};
}

template <typename Enum>
Status read_enum(std::uint32_t value, Enum last, Enum& to, const char* field) {
  if (value > static_cast<std::uint32_t>(last)) {
    return damaged(fmt::format("found {}, expected 0..{}", value, static_cast<std::uint32_t>(last)), field);
  }
  to = static_cast<Enum>(value);
  return {};
}

// What the document holds was within the limits when it was made; only its form is checked here.
Limits without_bounds() {
  Limits limits;
  limits.max_coordinate_m = std::numeric_limits<double>::max();
  limits.max_control_points = std::numeric_limits<std::size_t>::max();
  limits.max_trim_curves = std::numeric_limits<std::size_t>::max();
  return limits;
}

std::vector<Vec3> vectors_of(const v1::StoredVectors& message) {
  std::vector<Vec3> vectors(static_cast<std::size_t>(message.numbers_size()) / 3);
  for (std::size_t i = 0; i < vectors.size(); ++i) {
    const int at = static_cast<int>(3 * i);
    vectors[i] = {message.numbers(at), message.numbers(at + 1), message.numbers(at + 2)};
  }
  return vectors;
}

// Kinds of parts: how each is made of its bytes. An object is made once and shared by all that name it.

Result<std::shared_ptr<const std::string>> make_part(std::string bytes,
                                                     const std::shared_ptr<const std::string>*) {
  return std::make_shared<const std::string>(std::move(bytes));
}

Result<std::shared_ptr<const std::vector<Vec3>>> make_part(const std::string& bytes,
                                                           const std::shared_ptr<const std::vector<Vec3>>*) {
  v1::StoredVectors message;
  if (!message.ParseFromString(bytes)) return damaged("found no StoredVectors", "parts");
  return std::make_shared<const std::vector<Vec3>>(vectors_of(message));
}

Result<std::shared_ptr<const TrimCurve>> make_part(const std::string& bytes,
                                                   const std::shared_ptr<const TrimCurve>*) {
  v1::StoredVectors message;
  if (!message.ParseFromString(bytes)) return damaged("found no StoredVectors", "parts");
  return std::make_shared<const TrimCurve>(vectors_of(message));
}

Result<std::shared_ptr<const ReferenceMesh>> make_part(const std::string& bytes,
                                                       const std::shared_ptr<const ReferenceMesh>*) {
  v1::TriangleMesh message;
  if (!message.ParseFromString(bytes)) return damaged("found no TriangleMesh", "parts");
  auto mesh = std::make_shared<ReferenceMesh>();
  mesh->positions.resize(static_cast<std::size_t>(message.positions_size()) / 3);
  for (std::size_t i = 0; i < 3 * mesh->positions.size(); ++i)
    mesh->positions[i / 3][i % 3] = message.positions(static_cast<int>(i));
  mesh->triangles.resize(static_cast<std::size_t>(message.indices_size()) / 3);
  for (std::size_t i = 0; i < 3 * mesh->triangles.size(); ++i) {
    const std::uint32_t index = message.indices(static_cast<int>(i));
    if (index >= mesh->positions.size()) {
      return damaged(fmt::format("found vertex {} of {}", index, mesh->positions.size()), "parts.indices");
    }
    mesh->triangles[i / 3][i % 3] = index;
  }
  return std::shared_ptr<const ReferenceMesh>(std::move(mesh));
}

Result<std::shared_ptr<const geometry::BSplineSurface>> make_part(
    const std::string& bytes, const std::shared_ptr<const geometry::BSplineSurface>*) {
  v1::BSplineSurface message;
  if (!message.ParseFromString(bytes)) return damaged("found no BSplineSurface", "parts");
  auto surface = read_surface(message, "parts.surface", without_bounds());
  if (!surface) return damaged(surface.error().message, surface.error().field);
  return std::make_shared<const geometry::BSplineSurface>(*std::move(surface));
}

Result<std::shared_ptr<const FaceTrim>> make_part(const std::string& bytes,
                                                  const std::shared_ptr<const FaceTrim>*) {
  v1::StoredTrim message;
  if (!message.ParseFromString(bytes)) return damaged("found no StoredTrim", "parts");
  auto trim = read_trim(message.loops(), "parts.loops", without_bounds());
  if (!trim) return damaged(trim.error().message, trim.error().field);
  return std::make_shared<const FaceTrim>(*std::move(trim));
}

Result<std::shared_ptr<const PointBlock>> make_part(const std::string& bytes,
                                                    const std::shared_ptr<const PointBlock>*) {
  v1::StoredPoints message;
  if (!message.ParseFromString(bytes)) return damaged("found no StoredPoints", "parts");
  const int count = message.pressures_size();
  if (count == 0 || static_cast<std::size_t>(count) > PointCloud::chunk_size ||
      message.positions_size() != 3 * count || message.times_ns_size() != count ||
      message.strokes_size() != count || message.partners_size() != count) {
    return damaged(
        fmt::format("found {} points whose parts do not fit, expected 1..{}", count, PointCloud::chunk_size),
        "parts.points");
  }
  std::vector<DualPoint> points(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    DualPoint& point = points[static_cast<std::size_t>(i)];
    point.x = message.positions(3 * i);
    point.y = message.positions(3 * i + 1);
    point.z = message.positions(3 * i + 2);
    point.pressure = message.pressures(i);
    point.time_ns = message.times_ns(i);
    point.stroke = message.strokes(i);
    point.partner = message.partners(i);
  }
  return std::make_shared<const PointBlock>(points);
}

Result<std::shared_ptr<const FittedSurface>> make_part(const std::string& bytes,
                                                       const std::shared_ptr<const FittedSurface>*) {
  v1::StoredFit message;
  if (!message.ParseFromString(bytes)) return damaged("found no StoredFit", "parts");
  const auto surface_box = box_of(message.surface_box(), "parts.fit.surface_box");
  if (!surface_box) return surface_box.error();
  const auto footprint = box_of(message.footprint_box(), "parts.fit.footprint_box");
  if (!footprint) return footprint.error();
  const auto& coefficients = message.scaled_coefficients();
  if (message.degree() > static_cast<std::uint32_t>(geometry::max_degree))
    return damaged(fmt::format("found {}, expected 1..{}", message.degree(), geometry::max_degree),
                   "parts.fit.degree");
  auto surface = geometry::PolynomialSurface::from_scaled(
      static_cast<int>(message.degree()), *surface_box,
      {coefficients.data(), static_cast<std::size_t>(coefficients.size())});
  if (!surface) return damaged(surface.error().message, "parts.fit." + surface.error().field);
  auto fit = std::make_shared<FittedSurface>();
  fit->frame.origin = vector_of(message.frame().origin());
  fit->frame.rotation.col(0) = vector_of(message.frame().x());
  fit->frame.rotation.col(1) = vector_of(message.frame().y());
  fit->frame.rotation.col(2) = vector_of(message.frame().z());
  fit->surface = *surface;
  fit->requested_degree = message.requested_degree();
  fit->residuals_m.assign(message.residuals_m().begin(), message.residuals_m().end());
  fit->statistics = {static_cast<std::size_t>(message.count()), message.rms(), message.weighted_rms(),
                     message.max()};
  fit->cross_validated_rms_m.assign(message.cross_validated_rms_m().begin(),
                                    message.cross_validated_rms_m().end());
  fit->box = *footprint;
  fit->frame_drift_rad = message.frame_drift_rad();
  return std::shared_ptr<const FittedSurface>(std::move(fit));
}

class Decoder {
 public:
  Decoder(const v1::StoredModel& message, const FetchPart& fetch) : message_(message), fetch_(fetch) {}

  Result<StoredState> decode(std::size_t max_history_steps) {
    for (const v1::StoredEntity& entity : message_.entities()) {
      auto read = read_entity(entity);
      if (!read) {
        Error error = read.error();
        error.field = fmt::format("entities[{}].{}", entities_.size(), error.field);
        return error;
      }
      entities_.push_back(*std::move(read));
    }
    for (const v1::StoredEntitySet& set : message_.sets()) {
      auto entities = std::make_shared<Document::Entities>();
      if (auto status = put(set.entities(), *entities); !status) return status.error();
      sets_.push_back(std::move(entities));
    }
    if (auto status = read_annotations(); !status) return status.error();
    auto history = message_.version() == 1 ? read_line(max_history_steps) : read_lines(max_history_steps);
    if (!history) return history.error();
    return StoredState{*std::move(history), message_.sequence()};
  }

 private:
  template <typename T>
  Status part(std::uint32_t place, std::shared_ptr<const T>& to) {
    auto& made = std::get<std::map<std::uint32_t, std::shared_ptr<const T>>>(made_);
    if (const auto found = made.find(place); found != made.end()) {
      to = found->second;
      return {};
    }
    if (place >= static_cast<std::uint32_t>(message_.parts_size())) {
      return damaged(fmt::format("found part {} of {}", place, message_.parts_size()), "parts");
    }
    auto bytes = part_bytes(message_.parts(static_cast<int>(place)));
    if (!bytes) return bytes.error();
    auto part = make_part(*std::move(bytes), &to);
    if (!part) return part.error();
    to = *std::move(part);
    made.emplace(place, to);
    return {};
  }

  Result<std::string> part_bytes(const v1::StoredPart& part) {
    if (!part.has_sha256()) return part.inside();
    auto bytes = fetch_(part.sha256());
    if (bytes && as_bytes(content_hash(*bytes)) != part.sha256()) {
      return damaged(fmt::format("found other content than {} names", to_hex(part.sha256())), "parts");
    }
    return bytes;
  }

  Result<EntityPtr> read_entity(const v1::StoredEntity& message) {
    const auto finish = [&](auto entity, const Status& status) -> Result<EntityPtr> {
      if (!status) return status.error();
      entity->id = message.id();
      entity->name = message.name();
      if (message.has_motion()) {
        auto motion = read_motion(message.motion());
        if (!motion) return motion.error();
        entity->motion = *std::move(motion);
      }
      return EntityPtr(std::move(entity));
    };
    switch (message.kind_case()) {
      case v1::StoredEntity::kDualShape: {
        auto shape = std::make_shared<DualShape>();
        const Status status = read_dual(message.dual_shape(), *shape);
        return finish(std::move(shape), status);
      }
      case v1::StoredEntity::kReference: {
        auto reference = std::make_shared<ReferenceShape>();
        const Status status = part(message.reference(), reference->mesh);
        return finish(std::move(reference), status);
      }
      case v1::StoredEntity::kSculptSurface: {
        auto sculpted = std::make_shared<SculptShape>();
        const Status status = read_sculpt(message.sculpt_surface(), *sculpted);
        return finish(std::move(sculpted), status);
      }
      case v1::StoredEntity::kCadModel: {
        auto model = std::make_shared<CadModel>();
        const Status status = read_model(message.cad_model(), *model);
        return finish(std::move(model), status);
      }
      case v1::StoredEntity::KIND_NOT_SET:
        break;
    }
    return damaged("found no kind that this build knows", "kind");
  }

  Status read_dual(const v1::StoredDualShape& message, DualShape& shape) {
    shape.requested_degree = message.requested_degree();
    std::vector<PointBlock> blocks;
    blocks.reserve(static_cast<std::size_t>(message.chunks_size()));
    const std::uint64_t count = message.point_count();
    const auto chunks = static_cast<std::uint64_t>(message.chunks_size());
    for (const std::uint32_t chunk : message.chunks()) {
      std::shared_ptr<const PointBlock> block;
      if (auto status = part(chunk, block); !status) return status;
      blocks.push_back(*block);
    }
    bool fits = count / PointCloud::chunk_size + (count % PointCloud::chunk_size == 0 ? 0 : 1) == chunks;
    for (std::size_t i = 0; fits && i < blocks.size(); ++i) {
      const bool last = i + 1 == blocks.size();
      fits = blocks[i].size() >= (last ? count - i * PointCloud::chunk_size : PointCloud::chunk_size);
    }
    if (!fits)
      return damaged(fmt::format("found {} points in {} chunks that hold other numbers", count, chunks),
                     "point_count");
    shape.points = PointCloud::of_blocks(blocks, static_cast<std::size_t>(count));
    shape.stroke_count = message.stroke_count();
    if (message.has_fit()) {
      if (auto status = part(message.fit(), shape.fit); !status) return status;
    }
    shape.stale = message.stale();
    if (auto status = read_enum(message.symmetry(), SymmetryMode::partner, shape.symmetry, "symmetry");
        !status)
      return status;
    shape.plane = {vector_of(message.plane().origin()), vector_of(message.plane().normal())};
    shape.linked_from = message.linked_from();
    shape.partner = message.partner();
    shape.superellipse_exponent = message.superellipse_exponent();
    if (message.has_boundary()) {
      if (auto status = part(message.boundary(), shape.boundary); !status) return status;
    }
    return read_enum(message.representation(), Representation::both, shape.representation, "representation");
  }

  Status read_icon(const v1::StoredIcon& message, SculptIcon& icon) {
    icon.id = message.id();
    for (const Status& status :
         {read_enum(message.shape(), IconShape::region, icon.shape, "icon.shape"),
          read_enum(message.role(), IconRole::load, icon.role, "icon.role"),
          read_enum(message.property(), IconProperty::normal, icon.property, "icon.property"),
          read_enum(message.state(), IconState::sleeping, icon.state, "icon.state")}) {
      if (!status) return status;
    }
    icon.outside = message.outside();
    for (int i = 0; i + 1 < message.parameters_size(); i += 2)
      icon.parameters.emplace_back(message.parameters(i), message.parameters(i + 1));
    icon.stiffness = message.stiffness();
    icon.sensors.assign(message.sensors().begin(), message.sensors().end());
    if (message.has_reference()) {
      if (auto status = part(message.reference(), icon.reference); !status) return status;
    }
    icon.pivot = vector_of(message.pivot());
    icon.translation = vector_of(message.translation());
    icon.rotation = Eigen::Quaterniond(message.rotation().w(), message.rotation().x(), message.rotation().y(),
                                       message.rotation().z());
    for (const v1::StoredIconBend& bend : message.bends())
      icon.bends.push_back({bend.held_at(), bend.reach_m(), vector_of(bend.translation())});
    icon.place = vector_of(message.place());
    return {};
  }

  Status read_sculpt(const v1::StoredSculptShape& message, SculptShape& shape) {
    if (auto status = part(message.initial(), shape.initial); !status) return status;
    if (auto status = part(message.rest(), shape.rest); !status) return status;
    if (auto status = part(message.surface(), shape.surface); !status) return status;
    auto icons = std::make_shared<std::vector<SculptIcon>>(static_cast<std::size_t>(message.icons_size()));
    for (int i = 0; i < message.icons_size(); ++i) {
      if (auto status = read_icon(message.icons(i), (*icons)[static_cast<std::size_t>(i)]); !status)
        return status;
    }
    shape.icons = std::move(icons);
    const v1::SculptEnergy& energy = message.energy();
    shape.energy = {energy.a11(), energy.a12(), energy.a22(), energy.b11(), energy.b12(), energy.b22()};
    if (message.supports_size() != 4)
      return damaged(fmt::format("found {}, expected 4", message.supports_size()), "supports");
    geometry::Support* const sides[] = {&shape.supports.u_lower, &shape.supports.u_upper,
                                        &shape.supports.v_lower, &shape.supports.v_upper};
    for (int i = 0; i < 4; ++i) {
      if (auto status = read_enum(message.supports(i), geometry::Support::clamped, *sides[i], "supports");
          !status)
        return status;
    }
    shape.absolute = message.absolute();
    shape.least_squares = message.least_squares();
    for (const v1::StoredIconRemark& remark : message.remarks()) {
      IconRemark& to = shape.remarks.emplace_back();
      to.icon = remark.icon();
      to.off = remark.off();
      if (auto status = read_enum(remark.kind(), IconRemark::Kind::steep, to.kind, "remarks.kind"); !status)
        return status;
    }
    if (message.has_trim()) {
      if (auto status = part(message.trim(), shape.trim); !status) return status;
    }
    shape.model = message.model();
    shape.face = message.face();
    shape.reversed = message.reversed();
    return {};
  }

  Status read_model(const v1::StoredCadModel& message, CadModel& model) {
    if (auto status = part(message.boundary_representation(), model.boundary_representation); !status)
      return status;
    model.metres_per_unit = message.metres_per_unit();
    model.translation = vector_of(message.translation());
    if (message.has_rest()) {
      if (auto status = part(message.rest(), model.rest); !status) return status;
    }
    model.faces.assign(message.faces().begin(), message.faces().end());
    return {};
  }

  Status put(const google::protobuf::RepeatedField<std::uint32_t>& places, Document::Entities& to) {
    for (const std::uint32_t place : places) {
      if (place >= entities_.size())
        return damaged(fmt::format("found entity {} of {}", place, entities_.size()), "entities");
      to.insert_or_assign(entities_[place]->id, entities_[place]);
    }
    return {};
  }

  /// Version 1: steps as documents, one after the other, of which the first ones are applied.
  Result<History> read_line(std::size_t max_history_steps) {
    auto base = read_document(Document(), message_.base());
    if (!base) return base.error();
    if (message_.position() > static_cast<std::uint64_t>(message_.steps_size())) {
      return damaged(fmt::format("found {} of {} steps applied", message_.position(), message_.steps_size()),
                     "position");
    }
    // One after the other as they were made, each line of a client for itself.
    std::vector<History::Entry> entries;
    Document document = *std::move(base);
    Document current = document;
    for (int i = 0; i < message_.steps_size(); ++i) {
      const v1::StoredStep& step = message_.steps(i);
      auto after = read_document(document, step.after());
      if (!after) return after.error();
      const bool undone = static_cast<std::uint64_t>(i) >= message_.position();
      entries.push_back({std::make_shared<const History::Step>(
                             History::Step{delta_between(document, *after), read_info(step)}),
                         undone});
      document = *std::move(after);
      if (!undone) current = document;
    }
    return History(std::move(current), std::move(entries), max_history_steps);
  }

  Result<History> read_lines(std::size_t max_history_steps) {
    auto current = read_document(Document(), message_.current());
    if (!current) return current.error();
    std::vector<History::Entry> entries;
    std::set<std::uint64_t> taken_back;
    for (const v1::StoredStep& step : message_.steps()) {
      auto delta = read_delta(step.delta());
      if (!delta) return delta.error();
      if (step.undone()) taken_back.insert(step.client_id());
      if (!step.undone() && taken_back.contains(step.client_id())) {
        return damaged(
            fmt::format("found step {} behind one of its client that is taken back", entries.size()),
            "steps");
      }
      entries.push_back(
          {std::make_shared<const History::Step>(History::Step{*std::move(delta), read_info(step)}),
           step.undone()});
    }
    if (message_.version() == 2) return History(*std::move(current), std::move(entries), max_history_steps);
    History::Kept kept = read_gone();
    kept.current = *std::move(current);
    for (std::size_t i = 0; i < entries.size(); ++i)
      kept.steps.push_back({message_.steps(static_cast<int>(i)).number(), std::move(entries[i])});
    return History::restored(std::move(kept), max_history_steps);
  }

  History::Kept read_gone() const {
    const v1::StoredGone& gone = message_.gone();
    History::Kept kept;
    kept.last_step = gone.last_step();
    kept.early = static_cast<std::size_t>(gone.early_steps());
    kept.newest = {gone.newest().client_id(), gone.newest().step()};
    kept.before = {gone.before().client_id(), gone.before().step()};
    for (const v1::StoredGoneOf& of : gone.clients())
      kept.gone.push_back({of.client_id(), of.older(), of.newer(), {of.given_shape(), of.given_comment()}});
    for (const v1::StoredTouch& touch : gone.touched()) kept.forgotten.emplace(touch.key(), touch.step());
    kept.forgotten_highest = {gone.given_shape(), gone.given_comment()};
    kept.forgotten_sequence = gone.sequence();
    return kept;
  }

  static StepInfo read_info(const v1::StoredStep& step) {
    return {step.words(),  step.client_id(), step.client_op_id(),
            step.author(), step.made_ns(),   step.sequence()};
  }

  Status read_annotations() {
    EntityDigests digests;
    for (const v1::StoredVersion& message : message_.versions()) {
      if (message.set() >= sets_.size())
        return damaged(fmt::format("found set {} of {}", message.set(), sets_.size()), "versions.set");
      auto version = std::make_shared<Version>();
      version->name = message.name();
      version->note = message.note();
      version->author = message.author();
      version->made_ns = message.made_ns();
      version->alternative = message.alternative();
      version->sequence = message.sequence();
      version->parent = message.parent();
      version->entities = sets_[message.set()];
      version->digest = digests.of(*version->entities);
      versions_.push_back(std::move(version));
    }
    for (const v1::StoredComment& message : message_.comments()) {
      auto comment = std::make_shared<Comment>();
      comment->id = message.id();
      comment->text = message.text();
      comment->entity = message.entity();
      comment->place = vector_of(message.place());
      if (!comment->place.allFinite()) return damaged("found a place that is not finite", "comments.place");
      if (message.has_motion()) {
        auto motion = read_motion(message.motion());
        if (!motion) return motion.error();
        comment->motion = *std::move(motion);
      }
      comment->reply_to = message.reply_to();
      comment->resolved = message.resolved();
      comment->author = message.author();
      comment->client_id = message.client_id();
      comment->made_ns = message.made_ns();
      comment->changed_ns = message.changed_ns();
      comment->number = message.number();
      comments_.push_back(std::move(comment));
    }
    return {};
  }

  static Result<std::shared_ptr<const Similarity>> read_motion(const v1::StoredMotion& message) {
    Similarity motion;
    motion.scale = message.scale();
    motion.rotation = Eigen::Quaterniond(message.rotation().w(), message.rotation().x(),
                                         message.rotation().y(), message.rotation().z());
    motion.shift = vector_of(message.shift());
    if (!motion.finite() || !motion.inverse().finite())
      return damaged("found a motion that is not finite", "motion");
    return std::make_shared<const Similarity>(motion);
  }

  static const std::string& id_of(const Entity& entity) { return entity.id; }
  static const std::string& id_of(const Version& version) { return version.name; }
  static const std::string& id_of(const Comment& comment) { return comment.id; }

  template <typename Value>
  static Status read_changes(const google::protobuf::RepeatedPtrField<v1::StoredChange>& messages,
                             const std::vector<Value>& known, const char* field,
                             std::vector<StepDelta::Change<Value>>& to) {
    const auto value = [&](bool there, std::uint32_t place, const std::string& id, Value& out) -> Status {
      if (!there) return {};
      if (place >= known.size()) return damaged(fmt::format("found {} of {}", place, known.size()), field);
      if (id_of(*known[place]) != id) return damaged("found a change of another one", field);
      out = known[place];
      return {};
    };
    for (const v1::StoredChange& message : messages) {
      if (!message.has_before() && !message.has_after()) return damaged("found a change of nothing", field);
      if (!to.empty() && !(to.back().id < message.id())) return damaged("found ids out of order", field);
      auto& change = to.emplace_back();
      change.id = message.id();
      if (auto status = value(message.has_before(), message.before(), change.id, change.before); !status)
        return status;
      if (auto status = value(message.has_after(), message.after(), change.id, change.after); !status)
        return status;
    }
    return {};
  }

  Status read_wholes(const google::protobuf::RepeatedPtrField<v1::StoredWhole>& messages,
                     std::vector<StepDelta::Whole>& to) const {
    for (const v1::StoredWhole& message : messages) {
      if (message.set() >= sets_.size())
        return damaged(fmt::format("found set {} of {}", message.set(), sets_.size()), "delta.set");
      to.push_back({static_cast<std::size_t>(message.place()),
                    {message.name(), sets_[message.set()], message.version()}});
    }
    return {};
  }

  Result<StepDelta> read_delta(const v1::StoredDelta& message) const {
    StepDelta delta;
    delta.alternative = message.alternative();
    for (const Status& status :
         {read_changes(message.entities(), entities_, "delta.entities", delta.entities),
          read_changes(message.versions(), versions_, "delta.versions", delta.versions),
          read_changes(message.comments(), comments_, "delta.comments", delta.comments),
          read_wholes(message.made(), delta.made), read_wholes(message.deleted(), delta.deleted)}) {
      if (!status) return status.error();
    }
    delta.present_before = message.present_before();
    delta.present_after = message.present_after();
    for (const v1::StoredAt& at : message.at())
      delta.at.push_back({at.alternative(), at.before(), at.after()});
    delta.ids.assign(message.ids().begin(), message.ids().end());
    delta.next_shape_before = message.next_shape_before();
    delta.next_shape_after = message.next_shape_after();
    delta.next_comment_before = message.next_comment_before();
    delta.next_comment_after = message.next_comment_after();
    return delta;
  }

  Result<Document> read_document(const Document& before, const v1::StoredDocument& message) {
    Document document = before;
    if (auto status = put(message.entities(), document.entities); !status) return status.error();
    for (const std::string& id : message.removed()) document.entities.erase(id);
    if (message.used_ids_size() + message.unused_ids_size() > 0) {
      auto used = std::make_shared<Document::Ids>(*before.used_ids);
      used->insert(message.used_ids().begin(), message.used_ids().end());
      for (const std::string& id : message.unused_ids()) used->erase(id);
      document.used_ids = std::move(used);
    }
    document.next_shape = message.next_shape();
    document.present = static_cast<std::size_t>(message.present());
    if (message.has_alternatives()) {
      auto alternatives = std::make_shared<Alternatives>();
      for (const v1::StoredAlternative& alternative : message.alternatives()) {
        if (alternative.has_set() && alternative.set() >= sets_.size())
          return damaged(fmt::format("found set {} of {}", alternative.set(), sets_.size()), "alternatives");
        alternatives->push_back({alternative.name(),
                                 alternative.has_set() ? sets_[alternative.set()] : nullptr,
                                 alternative.version()});
      }
      document.alternatives = std::move(alternatives);
    }
    if (auto status = check_alternatives(document); !status) return status.error();
    if (message.next_comment() != 0) document.next_comment = message.next_comment();
    if (auto status = put_all(message.versions(), versions_, "versions", document.versions); !status)
      return status.error();
    if (auto status = put_all(message.comments(), comments_, "comments", document.comments); !status)
      return status.error();
    return document;
  }

  /// One is worked on, and all others know what they hold.
  static Status check_alternatives(const Document& document) {
    const Alternatives& alternatives = *document.alternatives;
    if (document.present >= alternatives.size()) {
      return damaged(fmt::format("found {} of {} alternatives", document.present, alternatives.size()),
                     "present");
    }
    std::set<std::string_view> names;
    for (std::size_t i = 0; i < alternatives.size(); ++i) {
      if ((i == document.present) != (alternatives[i].entities == nullptr))
        return damaged("found an alternative without what it holds", "alternatives");
      if (!names.insert(alternatives[i].name).second)
        return damaged("found two alternatives of one name", "alternatives");
    }
    return {};
  }

  template <typename Value, typename Map>
  static Status put_all(const google::protobuf::RepeatedField<std::uint32_t>& places,
                        const std::vector<Value>& known, const char* field, std::shared_ptr<const Map>& to) {
    if (places.empty()) return {};
    auto map = std::make_shared<Map>();
    for (const std::uint32_t place : places) {
      if (place >= known.size()) return damaged(fmt::format("found {} of {}", place, known.size()), field);
      map->insert_or_assign(id_of(*known[place]), known[place]);
    }
    to = std::move(map);
    return {};
  }

  template <typename... T>
  using Made = std::tuple<std::map<std::uint32_t, std::shared_ptr<const T>>...>;

  const v1::StoredModel& message_;
  const FetchPart& fetch_;
  Made<std::string, std::vector<Vec3>, TrimCurve, ReferenceMesh, geometry::BSplineSurface, FaceTrim,
       PointBlock, FittedSurface>
      made_;
  std::vector<EntityPtr> entities_;
  std::vector<std::shared_ptr<const Document::Entities>> sets_;
  std::vector<VersionPtr> versions_;
  std::vector<CommentPtr> comments_;
};

}  // namespace

Result<StoredState> decode_state(std::string_view bytes, const FetchPart& fetch,
                                 std::size_t max_history_steps) {
  v1::StoredModel message;
  if (bytes.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()) ||
      !message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    return damaged("found bytes that are no StoredModel", "snapshot");
  }
  if (message.version() == 0 || message.version() > newest_version) {
    return make_error(message.version() == 0 ? ErrorCode::data_corrupt : ErrorCode::unsupported,
                      fmt::format("found version {}, expected 1..{}", message.version(), newest_version),
                      "snapshot.version");
  }
  return Decoder(message, fetch).decode(max_history_steps);
}

}  // namespace handloft::model
