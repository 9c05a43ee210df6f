#pragma once
// STEP and IGES models with faces to be sculpted (issue: in and out): every face on a B-spline or Bezier
// surface comes as that surface with its trims, exactly; the whole model comes as bytes of the CAD kernel's
// own form, from which cad_export.h writes it again; all other faces come as triangles to look at.
//
// A surface that is periodic in the file stays so, with the same knots and control points: its seam is no
// border then. Its knots are the file's, so that the curves in its parameter plane still fit.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "server-model/exchange/cad_face.h"
#include "server-model/geometry/types.h"

namespace handloft::exchange {

struct CadImportOptions {
  geometry::Vec3 translation = geometry::Vec3::Zero();  ///< From the file into the world, metres.
  std::size_t max_file_bytes = 128U << 20U;             ///< As ReferenceOptions.
  std::size_t max_model_bytes = 256U << 20U;   ///< Of the kept form. This and the next: model::Limits.
  std::size_t max_faces = 4'000;               ///< On B-splines.
  std::size_t max_all_faces = 100'000;         ///< Each is looked at: seconds.
  std::size_t max_control_points = 1'050'000;  ///< Of one face.
  std::size_t max_trim_curves = 20'000;        ///< Of one face.
  double max_coordinate_m = 1e4;
  std::size_t max_vertices = 300'000;  ///< Of the other faces' triangles: coarser ones are made where needed.
  std::size_t max_triangles = 600'000;
  double chord_tolerance_m = 1e-4;  ///< Of those triangles; or `chord_fraction` of the diagonal if larger.
  double chord_fraction = 2e-5;
  /// Asked while triangles are made, from one thread. False: faces not yet reached have none, as a note says.
  std::function<bool()> keep_going;
};

struct ImportedFace {
  std::uint32_t number = 0;  ///< From 1, in the order of the model's faces.
  CadFace face;
};

struct ImportedModel {
  std::string boundary_representation;         ///< For cad_export.h; with a checksum.
  double metres_per_unit = 0.001;              ///< Of that representation, whatever the file's unit was.
  std::size_t face_count = 0;                  ///< Of all kinds.
  std::vector<ImportedFace> faces;             ///< On B-splines, ascending; may be none.
  std::vector<geometry::Vec3> rest_positions;  ///< World, metres; each value exactly a float.
  std::vector<std::uint32_t> rest_indices;     ///< Three a triangle, counterclockwise from outside.
  std::vector<std::string> notes;  ///< What was left as it is though it is a B-spline, and why; for people.
};

/// Errors, all with the field "path" and a message that begins with the file's name: not_found, io,
/// unsupported (extension), data_corrupt (not such a file, no face, coordinates out of bounds),
/// resource_exhausted (size, faces, control points and where they lie, trims, bytes, triangles), internal
/// (the CAD kernel); but invalid_argument with the field "translation". May be called from any thread; calls
/// queue, since the library's settings are global.
Result<ImportedModel> import_cad_model(const std::filesystem::path& path,
                                       const CadImportOptions& options = {});

}  // namespace handloft::exchange
