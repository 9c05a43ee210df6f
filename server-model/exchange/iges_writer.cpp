#include "server-model/exchange/iges_writer.h"

#include <fmt/format.h>

#include <IGESControl_Writer.hxx>
#include <IGESData_GlobalSection.hxx>
#include <IGESData_IGESEntity.hxx>
#include <IGESData_IGESModel.hxx>
#include <Interface_Static.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TopoDS_Face.hxx>
#include <locale>
#include <sstream>
#include <string>
#include <string_view>

#include "server-model/exchange/atomic_file.h"
#include "server-model/exchange/occt_face.h"
#include "server-model/exchange/occt_session.h"

namespace handloft::exchange {
namespace {

constexpr std::size_t label_length = 8;  // Of an entity's directory entry.

/// IGES is ASCII: what is not becomes '_'.
std::string ascii(std::string_view text) {
  std::string safe;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if ((byte & 0xC0U) == 0x80U) continue;  // The rest of a character of several bytes.
    safe.push_back(byte < ' ' || byte > '~' ? '_' : c);
  }
  return safe;
}

Handle(TCollection_HAsciiString) text_of(std::string_view text) {
  return new TCollection_HAsciiString(ascii(text).c_str());
}

Result<std::string> to_iges(std::span<const SurfaceExport> surfaces, const std::string& file_name,
                            const StepOptions& options) {
  Interface_Static::SetCVal("write.iges.unit", "MM");
  Interface_Static::SetIVal("write.surfacecurve.mode", 1);  // With curves in the parameter plane.
  constexpr int as_trimmed_surfaces = 0;
  IGESControl_Writer writer("MM", as_trimmed_surfaces);
  const Handle(IGESData_IGESModel) model = writer.Model();
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    const std::string field = fmt::format("surfaces[{}]", i);
    const Result<TopoDS_Face> face = detail::make_face(surfaces[i], options.contour_tolerance);
    if (!face.ok()) {
      Error error = face.error();
      error.field = field + (error.field.empty() ? "" : "." + error.field);
      return error;
    }
    const int entities_before = model->NbEntities();
    if (!writer.AddShape(*face)) {
      return make_error(ErrorCode::internal, "the CAD kernel didn't translate the face", field);
    }
    const Handle(TCollection_HAsciiString) label =
        text_of(surfaces[i].name.empty() ? "surface" : surfaces[i].name.substr(0, label_length));
    for (int k = entities_before + 1; k <= model->NbEntities(); ++k) {
      constexpr int trimmed_surface = 144;
      const Handle(IGESData_IGESEntity) entity = model->Entity(k);
      if (entity->TypeNumber() == trimmed_surface) entity->SetLabel(label);
    }
  }
  writer.ComputeModel();
  IGESData_GlobalSection global = model->GlobalSection();
  global.SetFileName(text_of(file_name));
  global.SetSystemId(text_of("Handloft"));
  global.SetSendName(text_of("Handloft"));
  global.SetReceiveName(text_of(""));
  global.SetAuthorName(text_of(options.author));
  global.SetCompanyName(text_of(options.organization));
  model->SetGlobalSection(global);
  std::ostringstream stream;
  stream.imbue(std::locale::classic());
  if (!writer.Write(stream, Standard_False) || !stream) {
    return make_error(ErrorCode::internal, "the CAD kernel didn't print the file", "surfaces");
  }
  return std::move(stream).str();
}

}  // namespace

Status write_iges(const std::filesystem::path& path, std::span<const SurfaceExport> surfaces,
                  const StepOptions& options) {
  if (surfaces.empty()) {
    return make_error(ErrorCode::invalid_argument, "found nothing to export, expected a surface", "surfaces");
  }
  if (!(options.contour_tolerance >= 1e-9 && options.contour_tolerance <= 1e-2)) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected 1e-9..1e-2", options.contour_tolerance),
                      "contour_tolerance");
  }
  std::string text;
  Status made = [&]() -> Status {
    const detail::OcctSession session;
    return detail::guarded("writing IGES", [&]() -> Status {
      Result<std::string> result = to_iges(surfaces, path.filename().string(), options);
      if (!result.ok()) return result.error();
      text = std::move(*result);
      return {};
    });
  }();
  if (!made.ok()) return made;
  return write_file_atomically(path, std::string_view(text));
}

}  // namespace handloft::exchange
