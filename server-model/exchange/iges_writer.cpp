#include "server-model/exchange/iges_writer.h"

#include <IGESControl_Writer.hxx>
#include <IGESData_GlobalSection.hxx>
#include <IGESData_IGESEntity.hxx>
#include <IGESData_IGESModel.hxx>
#include <IGESData_IGESWriter.hxx>
#include <IGESData_Protocol.hxx>
#include <Interface_FloatWriter.hxx>
#include <Interface_Static.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TopoDS_Shape.hxx>
#include <TransferBRep.hxx>
#include <TransferBRep_ShapeMapper.hxx>
#include <Transfer_FinderProcess.hxx>
#include <string>
#include <string_view>

#include "server-model/exchange/cad_file.h"

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

Handle(TCollection_HAsciiString) label_of(std::string_view name) {
  return text_of(ascii(name).substr(0, label_length));
}

/// The entity that was written for a part; the library knows parts by their orientation too.
void label_part(const IGESControl_Writer& writer, const TopoDS_Shape& part,
                const Handle(TCollection_HAsciiString) & label) {
  const Handle(Transfer_FinderProcess) process = writer.TransferProcess();
  for (const TopAbs_Orientation orientation : {TopAbs_FORWARD, TopAbs_REVERSED}) {
    Handle(IGESData_IGESEntity) entity;
    if (process->FindTypedTransient(TransferBRep::ShapeMapper(process, part.Oriented(orientation)),
                                    STANDARD_TYPE(IGESData_IGESEntity), entity)) {
      entity->SetLabel(label);
    }
  }
}

Result<std::string> to_iges(const CadContent& content, const std::string& file_name,
                            const StepOptions& options) {
  Interface_Static::SetCVal("write.iges.unit", "MM");
  Interface_Static::SetIVal("write.surfacecurve.mode", 1);  // With curves in the parameter plane.
  constexpr int as_trimmed_surfaces = 0;
  IGESControl_Writer writer("MM", as_trimmed_surfaces);
  const Handle(IGESData_IGESModel) model = writer.Model();
  const auto add = [&](const detail::NamedShape& named) -> Status {
    const int entities_before = model->NbEntities();
    if (!writer.AddShape(named.shape)) {
      return make_error(ErrorCode::internal, "the CAD kernel didn't translate the shape", named.field);
    }
    const Handle(TCollection_HAsciiString) label = label_of(named.name.empty() ? "surface" : named.name);
    // Of a face that its surface bounds readers look at the surface.
    for (int k = entities_before + 1; k <= model->NbEntities(); ++k) {
      constexpr int trimmed_surface = 144;
      constexpr int bspline_surface = 128;
      const Handle(IGESData_IGESEntity) entity = model->Entity(k);
      if (entity->TypeNumber() == trimmed_surface || entity->TypeNumber() == bspline_surface) {
        entity->SetLabel(label);
      }
    }
    for (const auto& [part, said] : named.parts) {
      if (!said.name.empty()) label_part(writer, part, label_of(said.name));
    }
    return {};
  };
  if (Status added = detail::for_each_shape(content, options, add); !added) return added.error();
  writer.ComputeModel();
  IGESData_GlobalSection global = model->GlobalSection();
  global.SetFileName(text_of(file_name));
  global.SetSystemId(text_of("Handloft"));
  global.SetSendName(text_of("Handloft"));
  global.SetReceiveName(text_of(""));
  global.SetAuthorName(text_of(options.author));
  global.SetCompanyName(text_of(options.organization));
  model->SetGlobalSection(global);
  IGESData_IGESWriter text(model);
  text.FloatWriter().SetFormat("%.15E");  // Every digit: by itself the library writes nine.
  text.SendModel(Handle(IGESData_Protocol)::DownCast(model->Protocol()));
  return detail::printed([&](std::ostream& stream) { return text.Print(stream); });
}

}  // namespace

Result<std::string> iges_text(const std::string& file_name, const CadContent& content,
                              const StepOptions& options) {
  return detail::make_cad_text(content, options, "writing IGES",
                               [&] { return to_iges(content, file_name, options); });
}

Status write_iges(const std::filesystem::path& path, const CadContent& content, const StepOptions& options) {
  return detail::write_cad_text(path, iges_text(path.filename().string(), content, options));
}

Status write_iges(const std::filesystem::path& path, std::span<const SurfaceExport> surfaces,
                  const StepOptions& options) {
  return write_iges(path, CadContent{surfaces, {}, {}}, options);
}

}  // namespace handloft::exchange
