#include "server-model/session/resolve_operation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "common/codec/tilt_file.h"
#include "server-model/exchange/stroke_import.h"
#include "server-model/model/validate.h"
#include "server-model/session/resolve_model.h"
#include "server-model/store/side_files.h"

namespace handloft::model {

namespace fs = std::filesystem;
namespace v1 = handloft::v1;

namespace {

Result<fs::path> place(const std::string& path, const fs::path& folder, FileAccess::Scope scope,
                       const std::string& field) {
  constexpr std::size_t max_path_bytes = 4096;
  if (path.empty() || path.size() > max_path_bytes || path.find('\0') != std::string::npos) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found a path of {} bytes, expected 1..{} without NUL", path.size(), max_path_bytes),
        field);
  }
  const fs::path asked = path;
  const fs::path placed = asked.is_absolute() ? asked : folder / asked;
  if (scope == FileAccess::Scope::anywhere) return placed;
  std::error_code failed;
  const fs::path root = fs::weakly_canonical(folder, failed);
  const fs::path target = failed ? fs::path() : fs::weakly_canonical(placed, failed);
  const auto [root_end, ignored] = std::mismatch(root.begin(), root.end(), target.begin(), target.end());
  if (failed || asked.is_absolute() || root_end != root.end()) {
    return make_error(ErrorCode::permission_denied, "found a path that leads out of the server's folder",
                      field);
  }
  return target;
}

/// By whatever links they are called.
bool is_of(const fs::path& target, const fs::path& own) {
  std::error_code failed;
  const fs::path found = fs::weakly_canonical(target, failed);
  // No file can be opened by such a name: what writes says so better.
  if (failed == std::errc::filename_too_long || failed == std::errc::too_many_symbolic_link_levels)
    return false;
  if (failed) return true;  // Nothing is known of it.
  const fs::path kept = fs::weakly_canonical(own, failed);
  if (failed) return false;
  const auto [kept_end, rest] = std::mismatch(kept.begin(), kept.end(), found.begin(), found.end());
  if (kept_end == kept.end()) return true;
  for (const char* beside : store::side_suffixes) {
    if (found == kept.string() + beside) return true;
  }
  return fs::equivalent(found, kept, failed) && !failed;
}

// Default extent of imported strokes: what a hand reaches over the table without moving the arm.
constexpr double default_box_m = 0.2;

Result<double> checked_length(double value, double otherwise, const char* field, const Limits& limits) {
  if (!(value >= 0 && value <= limits.max_coordinate_m)) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found {}, expected 0 or a number up to {}", value, limits.max_coordinate_m), field);
  }
  return value == 0 ? otherwise : value;
}

/// What is wrong inside of the file: the request knows only its path.
Error in_file(Error error) {
  if (!error.field.empty() && error.field != "path") error.message = error.field + ": " + error.message;
  error.field = "import_strokes.path";
  return error;
}

Status select_strokes(codec::TiltFile& file, const v1::ImportStrokes& request) {
  if (request.strokes().empty()) return {};
  std::vector<codec::TiltStroke> chosen;
  std::vector<bool> taken(file.strokes.size(), false);
  for (int i = 0; i < request.strokes_size(); ++i) {
    const std::uint32_t index = request.strokes(i);
    if (index >= file.strokes.size() || taken[index]) {
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found {}, expected each of 0..{} at most once", index,
                                    static_cast<std::ptrdiff_t>(file.strokes.size()) - 1),
                        fmt::format("import_strokes.strokes[{}]", i));
    }
    taken[index] = true;
    chosen.push_back(file.strokes[index]);
  }
  file.strokes = std::move(chosen);
  return {};
}

Result<exchange::ImportedStrokes> place_strokes(const codec::TiltFile& file, const v1::ImportStrokes& request,
                                                const Limits& limits) {
  auto box = checked_length(request.box_m(), default_box_m, "import_strokes.box_m", limits);
  if (!box) return box.error();
  auto scale = checked_length(request.scale(), 0.0, "import_strokes.scale", limits);
  if (!scale) return scale.error();
  const auto& centre = request.centre();
  for (const auto& [value, name] :
       {std::pair{centre.x(), "x"}, std::pair{centre.y(), "y"}, std::pair{centre.z(), "z"}}) {
    if (auto status = check_coordinate(value, fmt::format("import_strokes.centre.{}", name), limits);
        !status) {
      return status.error();
    }
  }
  exchange::StrokePlacement placement;
  placement.scale_m_per_unit = 1.0;
  auto measured = exchange::import_strokes(file, placement);
  if (!measured) return in_file(measured.error());
  const double extent = (measured->upper - measured->lower).maxCoeff();
  if (*scale > 0) {
    placement.scale_m_per_unit = *scale;
  } else if (extent > 0) {
    placement.scale_m_per_unit = *box / extent;
  }
  const geometry::Vec3 middle = measured->lower + 0.5 * (measured->upper - measured->lower);
  placement.translation =
      geometry::Vec3(centre.x(), centre.y(), centre.z()) - placement.scale_m_per_unit * middle;
  auto placed = exchange::import_strokes(file, placement);
  if (!placed) return in_file(placed.error());
  const double reach = placed->lower.cwiseAbs().cwiseMax(placed->upper.cwiseAbs()).maxCoeff();
  if (!(reach <= limits.max_coordinate_m)) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("the strokes would reach {} m from the origin, expected at most {} m",
                                  reach, limits.max_coordinate_m),
                      *scale > 0 ? "import_strokes.scale" : "import_strokes.box_m");
  }
  return placed;
}

Result<v1::Operation> resolve_reference(const v1::Operation& operation, const FileAccess& files,
                                        const Limits& limits) {
  const v1::ImportReference& request = operation.import_reference();
  if (request.path().empty()) {
    if (request.has_resolved()) return operation;
    return make_error(ErrorCode::invalid_argument,
                      "the path is missing, expected that of an OBJ, STL, PLY, glTF, GLB, STEP or IGES file",
                      "import_reference.path");
  }
  auto path = files.to_read(request.path(), "import_reference.path");
  if (!path) return path.error();
  exchange::ReferenceOptions options;
  options.scale = request.scale();
  options.up = request.y_up() ? exchange::UpAxis::y : exchange::UpAxis::z;
  options.translation = {request.translation().x(), request.translation().y(), request.translation().z()};
  options.max_vertices = limits.max_reference_vertices;
  options.max_triangles = limits.max_reference_triangles;
  options.max_coordinate_m = limits.max_coordinate_m;
  auto imported = files.cad_kernel().import_reference(*path, options);
  if (!imported) {
    Error error = imported.error();
    error.field = "import_reference." + error.field;
    return error;
  }
  v1::Operation resolved = operation;
  v1::ImportReference& into = *resolved.mutable_import_reference();
  if (into.name().empty()) into.set_name(path->stem().string());
  into.clear_path();
  into.clear_scale();
  into.clear_y_up();
  into.clear_translation();
  v1::TriangleMesh& mesh = *into.mutable_resolved();
  mesh.Clear();
  mesh.mutable_positions()->Reserve(static_cast<int>(3 * imported->positions.size()));
  for (const geometry::Vec3& position : imported->positions) {
    for (int axis = 0; axis < 3; ++axis) mesh.add_positions(static_cast<float>(position[axis]));
  }
  mesh.mutable_indices()->Add(imported->indices.begin(), imported->indices.end());
  return resolved;
}

}  // namespace

Result<fs::path> FileAccess::to_read(const std::string& path, const std::string& field) const {
  return place(path, read_folder, scope, field);
}

Result<fs::path> FileAccess::to_write(const std::string& path, const std::string& field) const {
  auto placed = place(path, write_folder, scope, field);
  if (placed &&
      std::any_of(own.begin(), own.end(), [&](const fs::path& each) { return is_of(*placed, each); }))
    return make_error(ErrorCode::permission_denied,
                      "found a file of the server's own, expected one that is not", field);
  return placed;
}

const exchange::CadKernel& FileAccess::cad_kernel() const {
  static const exchange::CadKernel in_this_process;
  return cad ? *cad : in_this_process;
}

Result<v1::Operation> resolve_operation(const v1::Operation& operation, const FileAccess& files,
                                        const Limits& limits) {
  if (operation.has_import_reference()) return resolve_reference(operation, files, limits);
  if (operation.has_import_model()) return resolve_model(operation, files, limits);
  if (!operation.has_import_strokes()) return operation;
  const v1::ImportStrokes& request = operation.import_strokes();
  if (request.path().empty()) {
    if (!request.resolved().empty()) return operation;
    return make_error(ErrorCode::invalid_argument, "the path is missing, expected that of a .tilt file",
                      "import_strokes.path");
  }
  auto path = files.to_read(request.path(), "import_strokes.path");
  if (!path) return path.error();
  auto file = codec::read_tilt_file(*path);
  if (!file) return in_file(file.error());
  if (auto status = select_strokes(*file, request); !status) return status.error();
  if (file->point_count() > limits.max_points_per_operation) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("the file holds {} points, expected at most {}", file->point_count(),
                                  limits.max_points_per_operation),
                      "import_strokes.path");
  }
  if (file->point_count() == 0) {
    return make_error(ErrorCode::failed_precondition, "the file holds no points", "import_strokes.path");
  }
  auto placed = place_strokes(*file, request, limits);
  if (!placed) return placed.error();

  v1::Operation resolved = operation;
  v1::ImportStrokes& into = *resolved.mutable_import_strokes();
  into.clear_path();
  into.clear_resolved();
  for (const exchange::ImportedStroke& stroke : placed->strokes) {
    if (stroke.points.empty()) continue;
    v1::StrokePoints& points = *into.add_resolved();
    for (const exchange::StrokePoint& from : stroke.points) {
      v1::Point& point = *points.add_points();
      point.mutable_position()->set_x(from.position.x());
      point.mutable_position()->set_y(from.position.y());
      point.mutable_position()->set_z(from.position.z());
      point.set_pressure(from.pressure);
      point.set_time_ns(std::llround(from.time_s * 1e9));
    }
  }
  return resolved;
}

}  // namespace handloft::model
