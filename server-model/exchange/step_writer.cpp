#include "server-model/exchange/step_writer.h"

#include <APIHeaderSection_MakeHeader.hxx>
#include <IFSelect_ReturnStatus.hxx>
#include <Interface_Static.hxx>
#include <STEPConstruct.hxx>
#include <STEPControl_Writer.hxx>
#include <StepBasic_Product.hxx>
#include <StepData_Protocol.hxx>
#include <StepData_StepModel.hxx>
#include <StepData_StepWriter.hxx>
#include <StepRepr_RepresentationItem.hxx>
#include <TCollection_HAsciiString.hxx>
#include <Transfer_FinderProcess.hxx>
#include <XSControl_TransferWriter.hxx>
#include <XSControl_WorkSession.hxx>
#include <cmath>
#include <vector>

#include "server-model/exchange/cad_file.h"

namespace handloft::exchange {
namespace {

/// Part 21 strings have no control characters; an empty name would show as nothing in a CAD program's tree.
std::string step_name(const std::string& name) {
  std::string safe = name.empty() ? "surface" : name;
  for (char& c : safe) {
    if (static_cast<unsigned char>(c) < ' ' || c == '\x7f') c = ' ';
  }
  return safe;
}

void set_header(const Handle(StepData_StepModel) & model, const std::string& file_name,
                const StepOptions& options) {
  APIHeaderSection_MakeHeader header(model);
  const auto text = [](const std::string& value) {
    return new TCollection_HAsciiString(step_name(value).c_str());
  };
  header.SetName(text(file_name));
  header.SetOriginatingSystem(text("Handloft"));
  header.SetAuthorValue(1, new TCollection_HAsciiString(options.author.c_str()));
  header.SetOrganizationValue(1, new TCollection_HAsciiString(options.organization.c_str()));
}

/// Names the products that were added after `entities_before`: the library numbers them instead.
void name_products(const Handle(StepData_StepModel) & model, int entities_before, const std::string& name) {
  for (int i = entities_before + 1; i <= model->NbEntities(); ++i) {
    const Handle(StepBasic_Product) product = Handle(StepBasic_Product)::DownCast(model->Value(i));
    if (product.IsNull()) continue;
    product->SetId(new TCollection_HAsciiString(name.c_str()));
    product->SetName(new TCollection_HAsciiString(name.c_str()));
  }
}

Result<std::string> to_step(const CadContent& content, const std::string& file_name,
                            const StepOptions& options) {
  Interface_Static::SetIVal("write.surfacecurve.mode", 1);  // With curves in the parameter plane.
  Interface_Static::SetCVal("write.step.unit", "MM");
  Interface_Static::SetCVal("write.step.schema", "AP214IS");  // What the most programs read.
  STEPControl_Writer writer;
  const auto add = [&](const std::string& plain_name, const TopoDS_Shape& shape,
                       const std::string& field) -> Status {
    const std::string name = step_name(plain_name);
    const int entities_before = writer.Model()->NbEntities();
    if (writer.Transfer(shape, STEPControl_AsIs) != IFSelect_RetDone) {
      return make_error(ErrorCode::internal, "the CAD kernel didn't translate the shape", field);
    }
    const Handle(Transfer_FinderProcess) process = writer.WS()->TransferWriter()->FinderProcess();
    const Handle(StepRepr_RepresentationItem) item = STEPConstruct::FindEntity(process, shape);
    if (!item.IsNull()) item->SetName(new TCollection_HAsciiString(name.c_str()));
    name_products(writer.Model(), entities_before, name);
    return {};
  };
  if (Status added = detail::for_each_shape(content, options.contour_tolerance, add); !added)
    return added.error();
  const Handle(StepData_StepModel) model = writer.Model();
  set_header(model, file_name, options);
  StepData_StepWriter text(model);
  text.SendModel(Handle(StepData_Protocol)::DownCast(writer.WS()->Protocol()));
  return detail::printed([&](std::ostream& stream) { return text.Print(stream); });
}

}  // namespace

Status write_step(const std::filesystem::path& path, const CadContent& content, const StepOptions& options) {
  return detail::write_cad_file(path, content, options, "writing STEP", [&](const std::string& file_name) {
    return to_step(content, file_name, options);
  });
}

Status write_step(const std::filesystem::path& path, std::span<const SurfaceExport> surfaces,
                  const StepOptions& options) {
  return write_step(path, CadContent{surfaces, {}, {}}, options);
}

}  // namespace handloft::exchange
