#include "server-model/session/export_sculpted.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <charconv>
#include <iterator>
#include <string_view>
#include <utility>

#include "server-model/geometry/bspline_tessellate.h"
#include "server-model/model/sculpt_place.h"

namespace handloft::model {
namespace {

using geometry::Vec3;

/// From "<model>.face-<number>", as operation.proto promises; 0 when it is no such id.
std::uint32_t number_of_face(std::string_view id) {
  const std::size_t dash = id.rfind('-');
  std::uint32_t number = 0;
  if (dash != std::string_view::npos) std::from_chars(id.data() + dash + 1, id.data() + id.size(), number);
  return number;
}

std::string id_of_face(const std::string& model, std::uint32_t number) {
  return fmt::format("{}.face-{}", model, number);
}

SculptPtr face_of(const Document& document, const CadModel& model, const std::string& id) {
  SculptPtr face = as_sculpt(document.find(id));
  return face && face->model == model.id ? face : nullptr;
}

void turn_over(geometry::TriangleMesh& mesh) {
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3)
    std::swap(mesh.indices[i + 1], mesh.indices[i + 2]);
  for (Vec3& normal : mesh.normals) normal = -normal;
}

/// Flat triangles: the kept mesh has no normals, and the faces of machines have sharp edges.
geometry::TriangleMesh flat(const ReferenceMesh& from) {
  geometry::TriangleMesh mesh;
  for (const auto& triangle : from.triangles) {
    std::array<Vec3, 3> corner;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto& p = from.positions[triangle[k]];
      corner[k] = Vec3(p[0], p[1], p[2]);
    }
    const Vec3 across = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
    if (!(across.norm() > 0)) continue;
    for (const Vec3& p : corner) {
      mesh.indices.push_back(static_cast<std::uint32_t>(mesh.positions.size()));
      mesh.positions.push_back(p);
      mesh.normals.push_back(across.normalized());
      mesh.opacity.push_back(1.0);
    }
  }
  return mesh;
}

}  // namespace

CadModelPtr model_of_face(const Document& document, const SculptShape& face) {
  CadModelPtr model = as_cad_model(document.find(face.model));
  return model && std::find(model->faces.begin(), model->faces.end(), face.id) != model->faces.end()
             ? model
             : nullptr;
}

exchange::CadFace to_cad_face(const SculptShape& shape, exchange::Trim trim) {
  exchange::CadFace face{shape.name, *shape.surface, {}, shape.reversed};
  if (trim == exchange::Trim::box || !shape.trim) return face;
  for (const std::vector<TrimSpline>& loop : *shape.trim) {
    auto& curves = face.loops.emplace_back();
    for (const TrimSpline& curve : loop) curves.push_back({curve.knots, curve.control, curve.weights});
  }
  return face;
}

exchange::ModelExport to_cad_model(const Document& document, const CadModel& model) {
  exchange::ModelExport result;
  result.name = model.name;
  result.boundary_representation = model.boundary_representation;
  result.metres_per_unit = model.metres_per_unit;
  result.translation = model.translation;
  for (const std::string& id : model.faces) {
    if (const SculptPtr face = face_of(document, model, id)) {
      result.replaced.push_back({face->face, *face->surface});
    } else {
      result.removed.push_back(number_of_face(id));
    }
  }
  return result;
}

namespace {

/// As people know it: its id if it can be sculpted, and its name if it has one.
std::string called(const Document& document, const CadModel& model, std::uint32_t number,
                   const std::string& name) {
  const std::string id = id_of_face(model.id, number);
  const SculptPtr face = face_of(document, model, id);
  std::string text = face ? fmt::format("\"{}\"", id) : fmt::format("face {}", number);
  const std::string& known = face && face->name != id ? face->name : name;
  if (!known.empty() && known != "NONE") text += fmt::format(" ({})", known);
  return text;
}

}  // namespace

void note_gaps(const Document& document, const std::vector<CadModelPtr>& models,
               const std::vector<exchange::BorderGap>& gaps, std::vector<std::string>& notes) {
  constexpr std::size_t most = 16;
  for (std::size_t i = 0; i < models.size(); ++i) {
    const CadModel& model = *models[i];
    std::vector<exchange::BorderGap> own;
    std::copy_if(gaps.begin(), gaps.end(), std::back_inserter(own),
                 [i](const exchange::BorderGap& gap) { return gap.model == i; });
    std::stable_sort(own.begin(), own.end(), [](const auto& a, const auto& b) { return a.gap_m > b.gap_m; });
    for (std::size_t k = 0; k < std::min(own.size(), most); ++k) {
      const exchange::BorderGap& gap = own[k];
      constexpr double millimetres = 1e3;
      const std::string face = called(document, model, gap.face, gap.face_name);
      notes.push_back(
          gap.face == gap.neighbour
              ? fmt::format("\"{}\": {} came apart along its seam, by up to {:.3g} mm", model.id, face,
                            millimetres * gap.gap_m)
              : fmt::format("\"{}\": {} and {} came apart along their common edge, by up to {:.3g} mm",
                            model.id, face, called(document, model, gap.neighbour, gap.neighbour_name),
                            millimetres * gap.gap_m));
    }
    if (own.size() > most) {
      notes.push_back(fmt::format("\"{}\": {} more pairs of faces came apart, by up to {:.3g} mm", model.id,
                                  own.size() - most, 1e3 * own[most].gap_m));
    }
  }
}

namespace {

/// As of imported references: a tenth of a millimetre, more of what is larger than 5 m.
double chord_of(const std::vector<SculptPtr>& faces) {
  constexpr double chord_tolerance_m = 1e-4;
  constexpr double chord_fraction = 2e-5;
  Eigen::AlignedBox3d box;
  for (const SculptPtr& face : faces) {
    for (const Vec3& p : face->surface->control) box.extend(p);
  }
  return box.isEmpty() ? chord_tolerance_m
                       : std::max(chord_tolerance_m, chord_fraction * box.diagonal().norm());
}

Result<exchange::MeshExport> mesh_within(const SculptShape& shape, exchange::Trim trim, double chord_m) {
  const geometry::BSplineSurface& surface = *shape.surface;
  std::vector<geometry::TrimLoop> loops;
  if (trim != exchange::Trim::box) loops = trim_loops(shape);
  geometry::SurfaceMeshOptions options;
  options.chord_tolerance_m = chord_m;
  auto mesh = loops.empty() ? geometry::tessellate(surface, options)
                            : geometry::tessellate(surface, std::move(loops), options);
  if (!mesh) return mesh.error();
  if (shape.reversed) turn_over(*mesh);
  exchange::MeshExport result;
  result.name = shape.name;
  result.mesh = std::move(*mesh);
  return result;
}

}  // namespace

Result<exchange::MeshExport> to_mesh(const SculptPtr& shape, exchange::Trim trim) {
  return mesh_within(*shape, trim, chord_of({shape}));
}

Result<std::vector<exchange::MeshExport>> to_meshes(const Document& document, const CadModel& model) {
  std::vector<exchange::MeshExport> meshes;
  if (model.rest) {
    exchange::MeshExport rest;
    rest.name = model.name;
    rest.mesh = flat(*model.rest);
    if (!rest.mesh.indices.empty()) meshes.push_back(std::move(rest));
  }
  std::vector<SculptPtr> faces;
  for (const std::string& id : model.faces) {
    if (SculptPtr face = face_of(document, model, id)) faces.push_back(std::move(face));
  }
  const double chord_m = chord_of(faces);
  for (const SculptPtr& face : faces) {
    auto mesh = mesh_within(*face, exchange::Trim::contour, chord_m);
    if (!mesh) {
      Error error = mesh.error();
      error.message = "\"" + face->id + "\": " + error.message;
      return error;
    }
    meshes.push_back(std::move(*mesh));
  }
  return meshes;
}

}  // namespace handloft::model
