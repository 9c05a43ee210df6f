#include "server-model/exchange/cad_import.h"

#include <fmt/format.h>

#include <BRepMesh_IncrementalMesh.hxx>
#include <BRepTools.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <IGESControl_Reader.hxx>
#include <Message_ProgressIndicator.hxx>
#include <STEPControl_Reader.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Compound.hxx>
#include <TopoDS_Face.hxx>
#include <algorithm>
#include <utility>

#include "server-model/exchange/cad_bytes.h"
#include "server-model/exchange/cad_labels.h"
#include "server-model/exchange/cad_source.h"
#include "server-model/exchange/input_file.h"
#include "server-model/exchange/occt_bspline.h"
#include "server-model/exchange/occt_loops.h"
#include "server-model/exchange/occt_session.h"
#include "server-model/exchange/occt_triangles.h"
#include "server-model/exchange/reference_import.h"

namespace handloft::exchange {
namespace {

namespace fs = std::filesystem;
using detail::CadPlacement;

constexpr std::size_t max_notes = 32;

Error at_path(Error error) {
  if (!error.field.empty() && error.field != "path") error.message = error.field + ": " + error.message;
  error.field = "path";
  return error;
}

/// Ends the making of triangles when it is told to.
class Watch : public Message_ProgressIndicator {
 public:
  explicit Watch(const std::function<bool()>& keep_going) : keep_going_(keep_going) {}
  Standard_Boolean UserBreak() override { return keep_going_ && !keep_going_(); }
  void Show(const Message_ProgressScope& /*scope*/, const Standard_Boolean /*now*/) override {}

 private:
  const std::function<bool()>& keep_going_;
};

/// The face's surface with its trims. Errors beyond the options' bounds end the import; others mean that the
/// face stays as it is.
Result<CadFace> sculptable(const TopoDS_Face& face, const Handle(Geom_BSplineSurface) & spline,
                           const CadPlacement& placement, const CadImportOptions& options) {
  const auto points =
      static_cast<std::size_t>(spline->NbUPoles()) * static_cast<std::size_t>(spline->NbVPoles());
  if (points > options.max_control_points) {
    return make_error(
        ErrorCode::resource_exhausted,
        fmt::format("found {} control points, expected at most {}", points, options.max_control_points));
  }
  auto surface = detail::to_geometry(spline, placement);
  if (!surface) return surface.error();
  for (const geometry::Vec3& p : surface->control) {
    if (!(p.cwiseAbs().maxCoeff() <= options.max_coordinate_m)) {
      return make_error(ErrorCode::resource_exhausted,
                        fmt::format("found a control point {:.3g} m from the origin, expected at most {} m",
                                    p.cwiseAbs().maxCoeff(), options.max_coordinate_m));
    }
  }
  auto loops = detail::read_loops(face, *surface, options.max_trim_curves);
  if (!loops) return loops.error();
  return CadFace{{}, std::move(*surface), std::move(*loops), face.Orientation() == TopAbs_REVERSED};
}

/// Tells of a trim whose curves miss each other; they are joined by straight lines.
void note_gaps(std::size_t number, const CadFace& face, std::vector<std::string>& notes) {
  constexpr double told_m = 1e-5;  // Above what CAD systems call the same place.
  const auto place = [&](const geometry::Vec2& p) { return face.surface.evaluate(p.x(), p.y()); };
  double widest = 0;
  for (const std::vector<TrimCurve>& loop : face.loops) {
    geometry::Vec3 end = place(loop.back().control.back());
    for (const TrimCurve& curve : loop) {
      widest = std::max(widest, (place(curve.control.front()) - end).norm());
      end = place(curve.control.back());
    }
  }
  if (widest > told_m && notes.size() < max_notes) {
    notes.push_back(fmt::format("face {}: its trim has gaps of up to {:.3g} mm, which are bridged", number,
                                widest / detail::metres_per_millimetre));
  }
}

/// Triangles of what cannot be sculpted; coarser ones where they would be too many.
Status tessellate_rest(const TopoDS_Compound& rest, const CadImportOptions& options, ImportedModel& into) {
  auto chord = detail::chord_of(rest, options.chord_tolerance_m, options.chord_fraction);
  if (!chord) return chord.error();
  ReferenceOptions limits;
  limits.translation = options.translation;
  limits.max_vertices = options.max_vertices;
  limits.max_triangles = options.max_triangles;
  limits.max_coordinate_m = options.max_coordinate_m;
  constexpr int attempts = 4;
  constexpr double coarser = 4;
  double angle = detail::angular_tolerance_rad;
  for (int attempt = 1;; ++attempt) {
    IMeshTools_Parameters parameters;
    parameters.Deflection = *chord;
    parameters.Angle = angle;
    BRepTools::Clean(rest);
    const Handle(Watch) watch = new Watch(options.keep_going);
    const BRepMesh_IncrementalMesh meshed(rest, parameters, watch->Start());
    detail::RawTriangles raw;
    std::size_t bare = 0;
    Status fits;
    for (TopExp_Explorer it(rest, TopAbs_FACE); it.More() && fits; it.Next()) {
      const std::size_t before = raw.indices.size();
      fits = detail::append_triangles(TopoDS::Face(it.Current()), raw, limits);
      if (raw.indices.size() == before) ++bare;
    }
    const bool stopped = options.keep_going && !options.keep_going();
    if (fits && bare > 0 && stopped) {
      into.notes.push_back(fmt::format("{} faces are not shown: making triangles took too long", bare));
    }
    if (fits && raw.indices.empty()) return {};
    if (fits) {
      auto placed = detail::place_in_world(raw, 1.0, UpAxis::z, limits);
      if (placed) {
        into.rest_positions = std::move(placed->positions);
        into.rest_indices = std::move(placed->indices);
        return {};
      }
      fits = placed.error();
    }
    if (fits.error().code != ErrorCode::resource_exhausted || attempt == attempts || stopped) return fits;
    *chord *= coarser;
    angle = std::min(angle * 2, 1.5);
  }
}

Status read_model(XSControl_Reader& reader, detail::CadFormat kind, const fs::path& path,
                  const CadImportOptions& options, ImportedModel& into) {
  const auto whole = detail::read_whole(reader, path, kind);
  if (!whole) return whole.error();
  into.notes = whole->notes;
  auto bytes =
      detail::to_bytes({whole->shape, detail::labels_of(reader, whole->shape)}, options.max_model_bytes);
  if (!bytes) return bytes.error();
  // Faces are numbered as they will be found when the model is written again.
  const auto kept = detail::from_bytes(*bytes);
  if (!kept) return kept.error();
  into.boundary_representation = std::move(*bytes);
  into.metres_per_unit = detail::metres_per_millimetre;
  const CadPlacement placement{into.metres_per_unit, options.translation};

  TopoDS_Compound rest;
  const BRep_Builder builder;
  builder.MakeCompound(rest);
  bool any_rest = false;
  const detail::FaceNames names(kept->shape, kept->labels);
  for (TopExp_Explorer it(kept->shape, TopAbs_FACE); it.More(); it.Next()) {
    if (++into.face_count > options.max_all_faces) {
      return make_error(ErrorCode::resource_exhausted,
                        fmt::format("found more than {} faces", options.max_all_faces), "path");
    }
    const TopoDS_Face face = TopoDS::Face(it.Current());
    const Handle(Geom_Surface) surface = BRep_Tool::Surface(face);
    const Handle(Geom_BSplineSurface) spline =
        surface.IsNull() ? Handle(Geom_BSplineSurface)() : detail::bspline_of(surface);
    if (!spline.IsNull()) {
      auto found = sculptable(face, spline, placement, options);
      if (!found && found.error().code == ErrorCode::resource_exhausted) {
        Error error = found.error();
        error.message = fmt::format("face {}: {}", into.face_count, error.message);
        return error;
      }
      if (found) {
        if (into.faces.size() >= options.max_faces) {
          return make_error(ErrorCode::resource_exhausted,
                            fmt::format("found more than {} B-spline faces", options.max_faces), "path");
        }
        found->name = names.of(face);
        note_gaps(into.face_count, *found, into.notes);
        into.faces.push_back({static_cast<std::uint32_t>(into.face_count), std::move(*found)});
        continue;
      }
      if (into.notes.size() < max_notes) {
        into.notes.push_back(
            fmt::format("face {} stays as it is: {}", into.face_count, at_path(found.error()).message));
      }
    }
    builder.Add(rest, face);
    any_rest = true;
  }
  if (into.face_count == 0) {
    return make_error(ErrorCode::data_corrupt,
                      fmt::format("found no face, expected {} file with faces", detail::words(kind)), "path");
  }
  return any_rest ? tessellate_rest(rest, options, into) : Status();
}

Status check_translation(const CadImportOptions& options) {
  if (options.translation.cwiseAbs().maxCoeff() <= options.max_coordinate_m) return {};
  return make_error(ErrorCode::invalid_argument,
                    fmt::format("found a coordinate beyond {} m", options.max_coordinate_m), "translation");
}

Result<ImportedModel> import_file(const fs::path& path, const CadImportOptions& options) {
  const auto format = reference_format(path);
  if (!format || (*format != ReferenceFormat::step && *format != ReferenceFormat::iges)) {
    return make_error(ErrorCode::unsupported,
                      fmt::format("found the extension \"{}\", expected .step, .stp, .iges or .igs",
                                  path.extension().string()),
                      "path");
  }
  if (Status file = detail::check_input_file(path, options.max_file_bytes); !file) return file.error();
  if (Status translation = check_translation(options); !translation) return translation.error();
  ImportedModel model;
  const detail::OcctSession session;
  Status status = detail::guarded("reading the CAD model", [&]() -> Status {
    if (*format == ReferenceFormat::step) {
      STEPControl_Reader reader;
      return read_model(reader, detail::CadFormat::step, path, options, model);
    }
    IGESControl_Reader reader;
    return read_model(reader, detail::CadFormat::iges, path, options, model);
  });
  if (!status) return status.error();
  return model;
}

}  // namespace

Result<ImportedModel> import_cad_model(const fs::path& path, const CadImportOptions& options) {
  auto model = import_file(path, options);
  if (model) return model;
  Error error = model.error();
  if (error.field == "translation") return error;
  error = at_path(std::move(error));
  error.message = fmt::format("{}: {}", path.filename().string(), error.message);
  return error;
}

}  // namespace handloft::exchange
