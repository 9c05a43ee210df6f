#include "server-model/session/export.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <map>
#include <optional>
#include <set>
#include <string_view>

#include "server-model/exchange/atomic_file.h"
#include "server-model/exchange/cad_kernel.h"
#include "server-model/exchange/gltf_writer.h"
#include "server-model/exchange/obj_writer.h"
#include "server-model/exchange/opacity_cut.h"
#include "server-model/geometry/planar_faces.h"
#include "server-model/geometry/tessellate.h"
#include "server-model/model/validate.h"
#include "server-model/session/export_sculpted.h"

namespace handloft::model {

namespace fs = std::filesystem;
namespace v1 = handloft::v1;

namespace {

constexpr const char* known_extensions = ".step, .stp, .iges, .igs, .glb or .obj";

/// As the name ends: in lower case, with its dot.
std::string extension_of(const v1::Export& request) {
  std::string extension = fs::path(request.path()).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

std::optional<v1::Export::Format> format_by_extension(std::string_view extension) {
  if (extension == ".step" || extension == ".stp") return v1::Export::STEP;
  if (extension == ".iges" || extension == ".igs") return v1::Export::IGES;
  if (extension == ".glb") return v1::Export::GLB;
  if (extension == ".obj") return v1::Export::OBJ;
  return std::nullopt;
}

Result<v1::Export::Format> format_of(const v1::Export& request, FileAccess::Scope scope) {
  const std::string extension = extension_of(request);
  const auto by_extension = format_by_extension(extension);
  switch (request.format()) {
    case v1::Export::STEP:
    case v1::Export::GLB:
    case v1::Export::OBJ:
    case v1::Export::IGES:
      // Whoever works from elsewhere writes beside what is others'.
      if (scope == FileAccess::Scope::anywhere || by_extension == request.format()) return request.format();
      return make_error(
          ErrorCode::permission_denied,
          fmt::format("found the extension \"{}\" for {}, expected one of {} that fits the format", extension,
                      v1::Export::Format_Name(request.format()), known_extensions),
          "export.path");
    case v1::Export::FORMAT_BY_EXTENSION:
      break;
    default:
      return make_error(ErrorCode::invalid_argument, "found a format that does not exist", "export.format");
  }
  if (by_extension) return *by_extension;
  return make_error(ErrorCode::unsupported,
                    fmt::format("found the extension \"{}\", expected {}", extension, known_extensions),
                    "export.path");
}

/// What is written, each kind ascending by id.
struct Chosen {
  std::vector<DualPtr> shapes;
  std::vector<SculptPtr> surfaces;
  std::vector<CadModelPtr> models;
};

Result<std::set<std::string>> named(const Document& document, const v1::Export& request) {
  std::set<std::string> ids;
  for (int i = 0; i < request.entities_size(); ++i) {
    const std::string field = fmt::format("export.entities[{}]", i);
    auto entity = require_entity(document, request.entities(i), field);
    if (!entity) return entity.error();
    if ((*entity)->kind() == EntityKind::reference) {
      return make_error(
          ErrorCode::invalid_argument,
          fmt::format("found \"{}\", a reference, expected a dual_shape, sculpt_surface or cad_model",
                      (*entity)->id),
          field);
    }
    if (const DualPtr shape = as_dual(*entity); shape && !shape->fitted()) {
      return make_error(ErrorCode::failed_precondition, fmt::format("\"{}\" is not fitted yet", shape->id),
                        field);
    }
    ids.insert((*entity)->id);
  }
  return ids;
}

/// Those that are named; else all, but for a model's faces, which are written with it in any case.
Result<Chosen> chosen(const Document& document, const v1::Export& request) {
  const auto ids = named(document, request);
  if (!ids) return ids.error();
  const auto wanted = [&](const Entity& entity) { return ids->empty() || ids->contains(entity.id); };
  Chosen result;
  for (const auto& [id, entity] : document.entities) {
    if (!wanted(*entity)) continue;
    if (const DualPtr shape = as_dual(entity); shape && shape->fitted()) result.shapes.push_back(shape);
    if (const CadModelPtr model = as_cad_model(entity)) result.models.push_back(model);
    if (const SculptPtr surface = as_sculpt(entity)) {
      const CadModelPtr model = model_of_face(document, *surface);
      if (!model || !wanted(*model)) result.surfaces.push_back(surface);
    }
  }
  if (result.shapes.empty() && result.surfaces.empty() && result.models.empty()) {
    return make_error(ErrorCode::failed_precondition, "no shape is fitted yet, so there is nothing to export",
                      "export.entities");
  }
  return result;
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

/// What goes into a CAD file, with the entities behind each member.
Status write_cad(const Document& document, const Chosen& entities, exchange::Trim trim,
                 v1::Export::Format format, const fs::path& path, const exchange::CadKernel& kernel,
                 std::vector<std::string>& notes) {
  std::vector<exchange::SurfaceExport> surfaces;
  std::vector<exchange::CadFace> faces;
  std::vector<exchange::ModelExport> models;
  ShapesOfList ids;
  for (const DualPtr& shape : entities.shapes) {
    auto parts = faces_of(*shape, trim);
    if (!parts) return of_shape(shape->id, parts.error());
    for (exchange::SurfaceExport& part : *parts) {
      surfaces.push_back(std::move(part));
      ids["surfaces"].push_back(shape->id);
    }
  }
  for (const SculptPtr& surface : entities.surfaces) {
    faces.push_back(to_cad_face(*surface, trim));
    ids["faces"].push_back(surface->id);
  }
  for (const CadModelPtr& model : entities.models) {
    models.push_back(to_cad_model(document, *model));
    ids["models"].push_back(model->id);
  }
  const exchange::CadContent content{surfaces, faces, models};
  const auto made =
      kernel.text(format == v1::Export::IGES ? exchange::CadTextFormat::iges : exchange::CadTextFormat::step,
                  path.filename().string(), content, {});
  const Status written =
      made ? exchange::write_file_atomically(path, std::string_view(made->text)) : Status(made.error());
  if (!written) return of_request(written.error(), ids);
  note_gaps(document, entities.models, made->gaps, notes);
  return {};
}

/// What goes into a mesh file.
Status write_meshes(const Document& document, const Chosen& entities, exchange::Trim trim,
                    v1::Export::Format format, const fs::path& path) {
  std::vector<exchange::MeshExport> meshes;
  std::vector<exchange::PointCloudExport> clouds;
  ShapesOfList ids;
  const auto add = [&](const std::string& id, exchange::MeshExport mesh) {
    meshes.push_back(std::move(mesh));
    ids["meshes"].push_back(id);
  };
  for (const DualPtr& shape : entities.shapes) {
    auto mesh = mesh_of(*shape, trim);
    if (!mesh) return of_shape(shape->id, mesh.error());
    // A glTF fades out; an OBJ can't, and ends where CAD faces do.
    if (format == v1::Export::OBJ) mesh->mesh = exchange::cut_at_opacity(mesh->mesh, contour_opacity);
    add(shape->id, std::move(*mesh));
    if (format == v1::Export::GLB && shape->representation != Representation::surface) {
      clouds.push_back(points_of(*shape));
      ids["clouds"].push_back(shape->id);
    }
  }
  for (const SculptPtr& surface : entities.surfaces) {
    auto mesh = to_mesh(surface, trim);
    if (!mesh) return of_shape(surface->id, mesh.error());
    add(surface->id, std::move(*mesh));
  }
  for (const CadModelPtr& model : entities.models) {
    auto parts = to_meshes(document, *model);
    if (!parts) return of_shape(model->id, parts.error());
    for (exchange::MeshExport& part : *parts) add(model->id, std::move(part));
  }
  const Status written = format == v1::Export::GLB ? exchange::write_glb(path, meshes, clouds)
                                                   : exchange::write_obj(path, meshes);
  return written ? written : Status(of_request(written.error(), ids));
}

}  // namespace

Result<Exported> export_document(const Document& document, const v1::Export& request,
                                 const FileAccess& files) {
  auto path = files.to_write(request.path(), "export.path");
  if (!path) return path.error();
  auto format = format_of(request, files.scope);
  if (!format) return format.error();
  auto entities = chosen(document, request);
  if (!entities) return entities.error();

  Exported exported;
  exported.path = *path;
  for (const DualPtr& shape : entities->shapes) {
    exported.entities.push_back(shape->id);
    if (shape->stale) {
      exported.notes.push_back(
          fmt::format("\"{}\": exported as it was last fitted; its points have changed since", shape->id));
    }
  }
  for (const SculptPtr& surface : entities->surfaces) exported.entities.push_back(surface->id);
  for (const CadModelPtr& model : entities->models) exported.entities.push_back(model->id);
  std::sort(exported.entities.begin(), exported.entities.end());

  const auto trim = request.untrimmed() ? exchange::Trim::box : exchange::Trim::contour;
  const bool is_cad = *format == v1::Export::STEP || *format == v1::Export::IGES;
  const Status written =
      is_cad ? write_cad(document, *entities, trim, *format, *path, files.cad_kernel(), exported.notes)
             : write_meshes(document, *entities, trim, *format, *path);
  if (!written) return written.error();
  return exported;
}

}  // namespace handloft::model
