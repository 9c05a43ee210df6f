#include "server-model/model/canonical.h"

#include <openssl/evp.h>

#include <array>
#include <bit>
#include <cstdint>
#include <functional>
#include <memory>
#include <string_view>

#include "server-model/model/annotations.h"
#include "server-model/model/cad_model.h"
#include "server-model/model/reference_shape.h"
#include "server-model/model/sculpt_shape.h"

namespace handloft::model {

namespace {

// Collects little-endian bytes and hands them on in blocks. Strings and lists carry their length, so that no
// two documents share a form.
class Writer {
 public:
  using Sink = std::function<void(std::string_view)>;
  explicit Writer(Sink sink) : sink_(std::move(sink)) { buffer_.reserve(block_bytes + 64); }

  void u8(std::uint8_t value) { integer(value, 1); }
  void u32(std::uint32_t value) { integer(value, 4); }
  void u64(std::uint64_t value) { integer(value, 8); }
  void i64(std::int64_t value) { u64(static_cast<std::uint64_t>(value)); }
  void number(double value) { u64(std::bit_cast<std::uint64_t>(value)); }
  template <typename Vector>
  void vector(const Vector& values) {
    for (Eigen::Index i = 0; i < values.size(); ++i) number(values(i));
  }
  void text(std::string_view value) {
    u64(value.size());
    buffer_.append(value);
    flush_full();
  }
  void flush() {
    sink_(buffer_);
    buffer_.clear();
  }

 private:
  static constexpr std::size_t block_bytes = 1U << 16U;

  void integer(std::uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) buffer_.push_back(static_cast<char>((value >> (8 * i)) & 0xffU));
    flush_full();
  }
  void flush_full() {
    if (buffer_.size() >= block_bytes) flush();
  }

  Sink sink_;
  std::string buffer_;
};

void write_fit(Writer& out, const FittedSurface& fit) {
  out.vector(fit.frame.origin);
  for (int axis = 0; axis < 3; ++axis) out.vector(fit.frame.rotation.col(axis));
  out.u32(static_cast<std::uint32_t>(fit.surface.degree()));
  out.vector(fit.surface.box().centre);
  out.vector(fit.surface.box().half_extent);
  for (const double coefficient : fit.surface.scaled_coefficients()) out.number(coefficient);
  out.u32(fit.requested_degree);
  out.u64(fit.residuals_m.size());
  for (const double residual : fit.residuals_m) out.number(residual);
  out.u64(fit.statistics.count);
  out.number(fit.statistics.rms);
  out.number(fit.statistics.weighted_rms);
  out.number(fit.statistics.max);
  out.u64(fit.cross_validated_rms_m.size());
  for (const double rms : fit.cross_validated_rms_m) out.number(rms);
  out.vector(fit.box.centre);
  out.vector(fit.box.half_extent);
  out.number(fit.frame_drift_rad);
}

void write_shape(Writer& out, const DualShape& shape) {
  out.text("dual_shape");
  out.text(shape.id);
  out.text(shape.name);
  out.u32(shape.requested_degree);
  out.u64(shape.points.size());
  for (std::size_t c = 0; c < shape.points.chunk_count(); ++c) {
    for (const DualPoint& point : shape.points.chunk(c)) {
      out.number(point.x);
      out.number(point.y);
      out.number(point.z);
      out.number(point.pressure);
      out.i64(point.time_ns);
      out.u32(point.stroke);
      out.u32(point.partner);
    }
  }
  out.u32(shape.stroke_count);
  out.u8(shape.fit ? 1 : 0);
  if (shape.fit) write_fit(out, *shape.fit);
  out.u8(shape.stale ? 1 : 0);
  out.u8(static_cast<std::uint8_t>(shape.symmetry));
  out.vector(shape.plane.origin);
  out.vector(shape.plane.normal);
  out.u32(shape.linked_from);
  out.text(shape.partner);
  out.number(shape.superellipse_exponent);
  out.u8(shape.boundary ? 1 : 0);
  if (shape.boundary) {
    out.u64(shape.boundary->points().size());
    for (const geometry::Vec3& point : shape.boundary->points()) out.vector(point);
  }
  out.u8(static_cast<std::uint8_t>(shape.representation));
}

void write_mesh(Writer& out, const ReferenceMesh& mesh) {
  out.u64(mesh.positions.size());
  for (const auto& position : mesh.positions) {
    for (const float coordinate : position) out.u32(std::bit_cast<std::uint32_t>(coordinate));
  }
  out.u64(mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t index : triangle) out.u32(index);
  }
}

void write_reference(Writer& out, const ReferenceShape& reference) {
  out.text("reference");
  out.text(reference.id);
  out.text(reference.name);
  write_mesh(out, *reference.mesh);
}

void write_knots(Writer& out, const geometry::KnotVector& knots) {
  out.u32(static_cast<std::uint32_t>(knots.degree()));
  out.u8(knots.is_periodic() ? 1 : 0);
  out.u64(knots.knots().size());
  for (const double knot : knots.knots()) out.number(knot);
}

void write_weights(Writer& out, const std::vector<double>& weights) {
  out.u64(weights.size());
  for (const double weight : weights) out.number(weight);
}

void write_surface(Writer& out, const geometry::BSplineSurface& surface) {
  write_knots(out, surface.u);
  write_knots(out, surface.v);
  for (const geometry::Vec3& point : surface.control) out.vector(point);
  write_weights(out, surface.weights);
}

void write_icon(Writer& out, const SculptIcon& icon) {
  out.text(icon.id);
  out.u8(static_cast<std::uint8_t>(icon.shape));
  out.u8(static_cast<std::uint8_t>(icon.role));
  out.u8(static_cast<std::uint8_t>(icon.property));
  out.u8(static_cast<std::uint8_t>(icon.state));
  out.u8(icon.outside ? 1 : 0);
  out.u64(icon.parameters.size());
  for (const geometry::Vec2& parameter : icon.parameters) out.vector(parameter);
  out.number(icon.stiffness);
  out.u64(icon.sensors.size());
  for (const std::string& sensor : icon.sensors) out.text(sensor);
  out.u64(icon.reference ? icon.reference->size() : 0);
  if (icon.reference) {
    for (const geometry::Vec3& value : *icon.reference) out.vector(value);
  }
  out.vector(icon.pivot);
  out.vector(icon.translation);
  out.vector(icon.rotation.coeffs());
  out.u64(icon.bends.size());
  for (const IconBend& bend : icon.bends) {
    out.number(bend.held_at);
    out.number(bend.reach_m);
    out.vector(bend.translation);
  }
  out.vector(icon.place);
}

void write_sculpt(Writer& out, const SculptShape& shape) {
  out.text("sculpt_surface");
  out.text(shape.id);
  out.text(shape.name);
  write_surface(out, *shape.initial);
  write_surface(out, *shape.rest);
  write_surface(out, *shape.surface);
  out.u64(shape.icons->size());
  for (const SculptIcon& icon : *shape.icons) write_icon(out, icon);
  for (const double value : {shape.energy.a11, shape.energy.a12, shape.energy.a22, shape.energy.b11,
                             shape.energy.b12, shape.energy.b22}) {
    out.number(value);
  }
  for (const geometry::Support support :
       {shape.supports.u_lower, shape.supports.u_upper, shape.supports.v_lower, shape.supports.v_upper}) {
    out.u8(static_cast<std::uint8_t>(support));
  }
  out.u8(shape.absolute ? 1 : 0);
  out.u8(shape.least_squares ? 1 : 0);
  out.u64(shape.trim ? shape.trim->size() : 0);
  if (shape.trim) {
    for (const std::vector<TrimSpline>& loop : *shape.trim) {
      out.u64(loop.size());
      for (const TrimSpline& spline : loop) {
        write_knots(out, spline.knots);
        for (const geometry::Vec2& point : spline.control) out.vector(point);
        write_weights(out, spline.weights);
      }
    }
  }
  out.text(shape.model);
  out.u32(shape.face);
  out.u8(shape.reversed ? 1 : 0);
}

void write_model(Writer& out, const CadModel& model) {
  out.text("cad_model");
  out.text(model.id);
  out.text(model.name);
  out.text(*model.boundary_representation);
  out.number(model.metres_per_unit);
  out.vector(model.translation);
  out.u8(model.rest ? 1 : 0);
  if (model.rest) write_mesh(out, *model.rest);
  out.u64(model.faces.size());
  for (const std::string& face : model.faces) out.text(face);
}

void write_entity(Writer& out, const EntityPtr& entity) {
  if (const DualPtr shape = as_dual(entity)) {
    write_shape(out, *shape);
  } else if (const ReferencePtr reference = as_reference(entity)) {
    write_reference(out, *reference);
  } else if (const SculptPtr surface = as_sculpt(entity)) {
    write_sculpt(out, *surface);
  } else if (const CadModelPtr model = as_cad_model(entity)) {
    write_model(out, *model);
  }
}

void write_versions(Writer& out, const Document& document) {
  out.text("versions");
  out.u64(document.versions->size());
  for (const auto& [name, version] : *document.versions) {
    out.text(name);
    out.text(version->note);
    out.text(version->author);
    out.i64(version->made_ns);
    out.text(version->alternative);
    out.u64(version->sequence);
    out.text(version->parent);
    out.text(version->digest);
  }
  for (const Alternative& alternative : *document.alternatives) out.text(alternative.version);
}

void write_comments(Writer& out, const Document& document) {
  out.text("comments");
  out.u64(document.next_comment);
  out.u64(document.comments->size());
  for (const auto& [id, comment] : *document.comments) {
    out.text(id);
    out.text(comment->text);
    out.text(comment->entity);
    out.vector(place_now(document, *comment));
    out.text(comment->reply_to);
    out.u8(comment->resolved ? 1 : 0);
    out.text(comment->author);
    out.u64(comment->client_id);
    out.i64(comment->made_ns);
    out.i64(comment->changed_ns);
    out.u64(comment->number);
  }
}

void write_document(const Document& document, Writer::Sink sink) {
  constexpr std::uint32_t version = 1;
  Writer out(std::move(sink));
  out.text("handloft document");
  out.u32(version);
  out.u64(document.entities.size());
  for (const auto& [id, entity] : document.entities) write_entity(out, entity);
  out.u64(document.used_ids->size());
  for (const std::string& id : *document.used_ids) out.text(id);
  out.u64(document.next_shape);
  out.u64(document.present);
  out.u64(document.alternatives->size());
  for (const Alternative& alternative : *document.alternatives) {
    out.text(alternative.name);
    out.u8(alternative.entities ? 1 : 0);
    if (!alternative.entities) continue;
    out.u64(alternative.entities->size());
    for (const auto& [id, entity] : *alternative.entities) write_entity(out, entity);
  }
  // Behind all else and only where there are any: documents from before have the hash that they had.
  if (!document.versions->empty()) write_versions(out, document);
  if (document.next_comment != 1) write_comments(out, document);
  out.flush();
}

}  // namespace

std::string EntityDigests::of(const Entities& entities) {
  ContentHash all;
  for (const auto& [id, entity] : entities) {
    auto found = seen_.find(entity.get());
    if (found == seen_.end()) {
      ContentHash one;
      Writer out([&](std::string_view block) { one.add(block); });
      write_entity(out, entity);
      out.flush();
      found = seen_.emplace(entity.get(), one.finish()).first;
    }
    all.add(as_bytes(found->second));
  }
  return to_hex(as_bytes(all.finish()));
}

std::string canonical_bytes(const Document& document) {
  std::string bytes;
  write_document(document, [&](std::string_view block) { bytes.append(block); });
  return bytes;
}

std::string document_hash(const Document& document) {
  const std::unique_ptr<EVP_MD_CTX, void (*)(EVP_MD_CTX*)> context(EVP_MD_CTX_new(), EVP_MD_CTX_free);
  bool good = context && EVP_DigestInit_ex(context.get(), EVP_sha256(), nullptr) == 1;
  write_document(document, [&](std::string_view block) {
    good = good && EVP_DigestUpdate(context.get(), block.data(), block.size()) == 1;
  });
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  good = good && EVP_DigestFinal_ex(context.get(), digest.data(), &size) == 1;
  if (!good) return {};  // Only when the machine is out of memory.
  constexpr std::string_view digits = "0123456789abcdef";
  std::string hex;
  hex.reserve(std::size_t{2} * size);
  for (unsigned i = 0; i < size; ++i) {
    hex.push_back(digits[digest[i] >> 4U]);
    hex.push_back(digits[digest[i] & 0xfU]);
  }
  return hex;
}

}  // namespace handloft::model
