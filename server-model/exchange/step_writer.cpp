#include "server-model/exchange/step_writer.h"

#include <APIHeaderSection_MakeHeader.hxx>
#include <IFSelect_ReturnStatus.hxx>
#include <Interface_Static.hxx>
#include <Quantity_Color.hxx>
#include <STEPConstruct.hxx>
#include <STEPConstruct_Part.hxx>
#include <STEPConstruct_Styles.hxx>
#include <STEPControl_Writer.hxx>
#include <StepBasic_Product.hxx>
#include <StepData_Protocol.hxx>
#include <StepData_StepModel.hxx>
#include <StepData_StepWriter.hxx>
#include <StepRepr_RepresentationContext.hxx>
#include <StepRepr_RepresentationItem.hxx>
#include <StepShape_ShapeDefinitionRepresentation.hxx>
#include <StepShape_ShapeRepresentation.hxx>
#include <StepVisual_Colour.hxx>
#include <StepVisual_MechanicalDesignGeometricPresentationRepresentation.hxx>
#include <StepVisual_PresentationStyleAssignment.hxx>
#include <StepVisual_StyledItem.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TransferBRep.hxx>
#include <TransferBRep_ShapeMapper.hxx>
#include <Transfer_FinderProcess.hxx>
#include <XSControl_TransferWriter.hxx>
#include <XSControl_WorkSession.hxx>
#include <cmath>
#include <vector>

#include "server-model/exchange/cad_file.h"

namespace handloft::exchange {
namespace {

using detail::LabelledPart;

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

Handle(TCollection_HAsciiString) handle_of(const std::string& text) {
  return new TCollection_HAsciiString(text.c_str());
}

void name_product(const Handle(StepBasic_Product) & product, const std::string& name) {
  product->SetId(handle_of(name));
  product->SetName(handle_of(name));
}

/// Names the products that were added after `entities_before`: the library numbers them instead.
void name_products(const Handle(StepData_StepModel) & model, int entities_before, const std::string& name) {
  for (int i = entities_before + 1; i <= model->NbEntities(); ++i) {
    const Handle(StepBasic_Product) product = Handle(StepBasic_Product)::DownCast(model->Value(i));
    if (!product.IsNull()) name_product(product, name);
  }
}

/// What the library wrote for a part, of a type: it knows parts by place and orientation too, and writes
/// components of an assembly without theirs.
template <typename Entity>
opencascade::handle<Entity> written(const Handle(Transfer_FinderProcess) & process,
                                    const TopoDS_Shape& part) {
  opencascade::handle<Entity> found;
  for (const TopoDS_Shape& placed : {part, part.Located(TopLoc_Location())}) {
    for (const TopAbs_Orientation orientation : {TopAbs_FORWARD, TopAbs_REVERSED}) {
      if (process->FindTypedTransient(TransferBRep::ShapeMapper(process, placed.Oriented(orientation)),
                                      STANDARD_TYPE(Entity), found)) {
        return found;
      }
    }
  }
  return found;
}

/// That of the first product's shape.
Handle(StepRepr_RepresentationContext) context_of(STEPControl_Writer& writer) {
  const Handle(StepData_StepModel) model = writer.Model();
  for (int i = 1; i <= model->NbEntities(); ++i) {
    const auto shape = Handle(StepShape_ShapeRepresentation)::DownCast(model->Value(i));
    if (!shape.IsNull() && !shape->ContextOfItems().IsNull()) return shape->ContextOfItems();
  }
  return {};
}

void write_labels(STEPControl_Writer& writer, const std::vector<LabelledPart>& parts) {
  const Handle(Transfer_FinderProcess) process = writer.WS()->TransferWriter()->FinderProcess();
  STEPConstruct_Styles styles(writer.WS());
  bool any_colour = false;
  for (const auto& [part, label] : parts) {
    if (!label.product.empty()) {
      const auto shape = written<StepShape_ShapeDefinitionRepresentation>(process, part);
      STEPConstruct_Part product;
      if (!shape.IsNull()) product.ReadSDR(shape);
      if (product.IsDone()) name_product(product.Product(), step_name(label.product));
    }
    const auto item = written<StepRepr_RepresentationItem>(process, part);
    if (item.IsNull()) continue;
    if (!label.name.empty()) item->SetName(handle_of(step_name(label.name)));
    if (!label.colour) continue;
    const auto& [red, green, blue] = *label.colour;
    const Handle(StepVisual_Colour) colour =
        STEPConstruct_Styles::EncodeColor(Quantity_Color(red, green, blue, Quantity_TOC_RGB));
    styles.AddStyle(item, styles.MakeColorPSA(item, colour, colour, nullptr, 0), nullptr);
    any_colour = true;
  }
  if (!any_colour) return;
  Handle(StepVisual_MechanicalDesignGeometricPresentationRepresentation) presentation;
  if (styles.CreateMDGPR(context_of(writer), presentation)) writer.Model()->AddWithRefs(presentation);
}

Result<std::string> to_step(const CadContent& content, const std::string& file_name,
                            const StepOptions& options) {
  Interface_Static::SetIVal("write.surfacecurve.mode", 1);  // With curves in the parameter plane.
  Interface_Static::SetCVal("write.step.unit", "MM");
  Interface_Static::SetCVal("write.step.schema", "AP214IS");  // What the most programs read.
  STEPControl_Writer writer;
  const auto add = [&](const detail::NamedShape& named) -> Status {
    const std::string name = step_name(named.name);
    const int entities_before = writer.Model()->NbEntities();
    if (writer.Transfer(named.shape, STEPControl_AsIs) != IFSelect_RetDone) {
      return make_error(ErrorCode::internal, "the CAD kernel didn't translate the shape", named.field);
    }
    const Handle(Transfer_FinderProcess) process = writer.WS()->TransferWriter()->FinderProcess();
    const Handle(StepRepr_RepresentationItem) item = STEPConstruct::FindEntity(process, named.shape);
    if (!item.IsNull()) item->SetName(handle_of(name));
    name_products(writer.Model(), entities_before, name);
    write_labels(writer, named.parts);
    return {};
  };
  if (Status added = detail::for_each_shape(content, options, add); !added) return added.error();
  const Handle(StepData_StepModel) model = writer.Model();
  set_header(model, file_name, options);
  StepData_StepWriter text(model);
  text.SendModel(Handle(StepData_Protocol)::DownCast(writer.WS()->Protocol()));
  return detail::printed([&](std::ostream& stream) { return text.Print(stream); });
}

}  // namespace

Result<std::string> step_text(const std::string& file_name, const CadContent& content,
                              const StepOptions& options) {
  return detail::make_cad_text(content, options, "writing STEP",
                               [&] { return to_step(content, file_name, options); });
}

Status write_step(const std::filesystem::path& path, const CadContent& content, const StepOptions& options) {
  return detail::write_cad_text(path, step_text(path.filename().string(), content, options));
}

Status write_step(const std::filesystem::path& path, std::span<const SurfaceExport> surfaces,
                  const StepOptions& options) {
  return write_step(path, CadContent{surfaces, {}, {}}, options);
}

}  // namespace handloft::exchange
