#include "server-model/session/export.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <map>
#include <set>

#include "server-model/exchange/gltf_writer.h"
#include "server-model/exchange/iges_writer.h"
#include "server-model/exchange/obj_writer.h"
#include "server-model/exchange/opacity_cut.h"
#include "server-model/exchange/step_writer.h"
#include "server-model/geometry/planar_faces.h"
#include "server-model/geometry/tessellate.h"
#include "server-model/model/validate.h"

namespace handloft::model {

namespace fs = std::filesystem;
namespace v1 = handloft::v1;

namespace {

Result<v1::Export::Format> format_of(const v1::Export& request) {
  switch (request.format()) {
    case v1::Export::STEP:
    case v1::Export::GLB:
    case v1::Export::OBJ:
    case v1::Export::IGES:
      return request.format();
    case v1::Export::FORMAT_BY_EXTENSION:
      break;
    default:
      return make_error(ErrorCode::invalid_argument, "found a format that does not exist", "export.format");
  }
  std::string extension = fs::path(request.path()).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension == ".step" || extension == ".stp") return v1::Export::STEP;
  if (extension == ".iges" || extension == ".igs") return v1::Export::IGES;
  if (extension == ".glb") return v1::Export::GLB;
  if (extension == ".obj") return v1::Export::OBJ;
  return make_error(
      ErrorCode::unsupported,
      fmt::format("found the extension \"{}\", expected .step, .stp, .iges, .igs, .glb or .obj", extension),
      "export.path");
}

Result<std::vector<DualPtr>> chosen(const Document& document, const v1::Export& request) {
  std::set<std::string> ids;
  for (int i = 0; i < request.entities_size(); ++i) {
    const std::string field = fmt::format("export.entities[{}]", i);
    auto entity = require_dual(document, request.entities(i), field);
    if (!entity) return entity.error();
    if (!(*entity)->fitted()) {
      return make_error(ErrorCode::failed_precondition,
                        fmt::format("\"{}\" is not fitted yet", (*entity)->id), field);
    }
    ids.insert((*entity)->id);
  }
  std::vector<DualPtr> entities;
  for (const auto& [id, entity] : document.entities) {
    const DualPtr shape = as_dual(entity);
    if (shape && (request.entities().empty() ? shape->fitted() : ids.contains(id))) entities.push_back(shape);
  }
  if (entities.empty()) {
    return make_error(ErrorCode::failed_precondition, "no shape is fitted yet, so there is nothing to export",
                      "export.entities");
  }
  return entities;
}

/// The surface as CAD faces: one, but where a boundary curve crosses itself one for each part that it
/// encloses (A24), the largest first.
Result<std::vector<exchange::SurfaceExport>> faces_of(const DualShape& shape, exchange::Trim trim) {
  auto superellipse = shape.superellipse();
  if (!superellipse) return superellipse.error();
  auto field = shape.trim();
  if (!field) return field.error();
  exchange::SurfaceExport whole{shape.name, shape.fit->surface, shape.fit->frame, *superellipse, trim};
  const geometry::BoundaryTrim* const boundary = field->boundary();
  if (boundary == nullptr) return std::vector{whole};
  if (trim == exchange::Trim::box) {
    const geometry::Vec2 lower = boundary->box().lower();
    const geometry::Vec2 upper = boundary->box().upper();
    whole.region.outer = {lower, {upper.x(), lower.y()}, upper, {lower.x(), upper.y()}};
    return std::vector{whole};
  }
  auto regions = geometry::planar_faces(boundary->polygon());
  if (!regions) return regions.error();
  std::vector<exchange::SurfaceExport> faces;
  for (geometry::PlanarFace& region : *regions) {
    faces.push_back(whole);
    faces.back().trim = exchange::Trim::region;
    faces.back().region = std::move(region);
    if (faces.size() > 1) faces.back().name = fmt::format("{} ({})", shape.name, faces.size());
  }
  return faces;
}

/// Where exports are trimmed (A26).
constexpr double contour_opacity = 0.5;

Result<exchange::MeshExport> mesh_of(const DualShape& shape, exchange::Trim trim) {
  auto field = shape.trim();
  if (!field) return field.error();
  const FittedSurface& fit = *shape.fit;
  auto mesh = trim == exchange::Trim::box
                  ? geometry::tessellate_box(fit.surface, fit.frame, field->solid_box())
                  : geometry::tessellate(fit.surface, fit.frame, *field);
  if (!mesh) return mesh.error();
  exchange::MeshExport result;
  result.name = shape.name;
  result.mesh = std::move(*mesh);
  return result;
}

Error of_shape(const std::string& id, Error error) {
  error.message = fmt::format("\"{}\": {}", id, error.message);
  error.field = "export.entities";
  return error;
}

/// Lists that the writers get, by the names that their errors call them, with the shape of each member.
using ShapesOfList = std::map<std::string, std::vector<std::string>>;

/// A writer's error in terms of the request: of "surfaces[1].surface" the user knows nothing.
Error of_request(Error error, const ShapesOfList& shapes) {
  const std::size_t bracket = error.field.find('[');
  if (const auto list = shapes.find(error.field.substr(0, bracket)); list != shapes.end()) {
    std::size_t index = list->second.size();
    if (bracket != std::string::npos) {
      const char* const end = error.field.data() + error.field.size();
      std::from_chars(error.field.data() + bracket + 1, end, index);
    }
    if (index < list->second.size()) return of_shape(list->second[index], std::move(error));
    error.field = "export.entities";
    return error;
  }
  if (!error.field.empty() && error.field != "path") error.message = error.field + ": " + error.message;
  error.field = "export.path";
  return error;
}

exchange::PointCloudExport points_of(const DualShape& shape) {
  exchange::PointCloudExport cloud;
  cloud.name = shape.name + " (points)";
  cloud.points.reserve(shape.points.size());
  for (const DualPoint& point : shape.points) cloud.points.push_back({point.position(), point.pressure});
  return cloud;
}

}  // namespace

Result<Exported> export_document(const Document& document, const v1::Export& request,
                                 const FileAccess& files) {
  auto path = files.to_write(request.path(), "export.path");
  if (!path) return path.error();
  auto format = format_of(request);
  if (!format) return format.error();
  auto entities = chosen(document, request);
  if (!entities) return entities.error();

  Exported exported;
  exported.path = *path;
  const auto trim = request.untrimmed() ? exchange::Trim::box : exchange::Trim::contour;
  std::vector<exchange::SurfaceExport> surfaces;
  std::vector<exchange::MeshExport> meshes;
  std::vector<exchange::PointCloudExport> clouds;
  std::vector<std::string> cloud_ids;
  std::vector<std::string> surface_ids;
  for (const DualPtr& entity : *entities) {
    exported.entities.push_back(entity->id);
    if (entity->stale) {
      exported.notes.push_back(
          fmt::format("\"{}\": exported as it was last fitted; its points have changed since", entity->id));
    }
    if (*format != v1::Export::STEP && *format != v1::Export::IGES) {
      auto mesh = mesh_of(*entity, trim);
      if (!mesh) return of_shape(entity->id, mesh.error());
      // A glTF fades out; an OBJ can't, and ends where CAD faces do.
      if (*format == v1::Export::OBJ) mesh->mesh = exchange::cut_at_opacity(mesh->mesh, contour_opacity);
      meshes.push_back(std::move(*mesh));
      if (*format == v1::Export::GLB && entity->representation != Representation::surface) {
        clouds.push_back(points_of(*entity));
        cloud_ids.push_back(entity->id);
      }
    }
    if (*format == v1::Export::STEP || *format == v1::Export::IGES) {
      auto faces = faces_of(*entity, trim);
      if (!faces) return of_shape(entity->id, faces.error());
      for (exchange::SurfaceExport& face : *faces) {
        surfaces.push_back(std::move(face));
        surface_ids.push_back(entity->id);
      }
    }
  }
  Status written;
  switch (*format) {
    case v1::Export::STEP:
      written = exchange::write_step(*path, surfaces);
      break;
    case v1::Export::IGES:
      written = exchange::write_iges(*path, surfaces);
      break;
    case v1::Export::GLB:
      written = exchange::write_glb(*path, meshes, clouds);
      break;
    default:
      written = exchange::write_obj(*path, meshes);
      break;
  }
  if (!written) {
    return of_request(written.error(),
                      {{"surfaces", surface_ids}, {"meshes", exported.entities}, {"clouds", cloud_ids}});
  }
  return exported;
}

}  // namespace handloft::model
