#include "server-model/exchange/cad_labels.h"

#include <IGESData_IGESEntity.hxx>
#include <Interface_InterfaceModel.hxx>
#include <Quantity_Color.hxx>
#include <STEPConstruct_Styles.hxx>
#include <StepBasic_Product.hxx>
#include <StepBasic_ProductDefinition.hxx>
#include <StepBasic_ProductDefinitionFormation.hxx>
#include <StepRepr_RepresentationItem.hxx>
#include <StepVisual_Colour.hxx>
#include <StepVisual_StyledItem.hxx>
#include <TCollection_AsciiString.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TopExp.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TransferBRep.hxx>
#include <Transfer_TransientProcess.hxx>
#include <XSControl_TransferReader.hxx>
#include <XSControl_WorkSession.hxx>
#include <map>
#include <utility>

#include "server-model/exchange/cad_source.h"

namespace handloft::exchange::detail {
namespace {

/// Parts of these kinds have names that people know.
constexpr std::array kinds{TopAbs_COMPOUND, TopAbs_COMPSOLID, TopAbs_SOLID, TopAbs_SHELL, TopAbs_FACE};

std::string text_of(const Handle(TCollection_HAsciiString) & text) {
  return text.IsNull() ? std::string() : std::string(text->ToCString());
}

/// Finds parts by what they are made of, wherever assemblies put them.
class Parts {
 public:
  explicit Parts(const TopoDS_Shape& whole) {
    for (const TopAbs_ShapeEnum kind : kinds) {
      TopTools_IndexedMapOfShape all;
      TopExp::MapShapes(whole, kind, all);
      for (int i = 1; i <= all.Extent(); ++i) {
        known_[all(i).TShape().get()].emplace_back(kind, static_cast<std::uint32_t>(i));
      }
    }
  }

  template <typename Change>
  void label(const TopoDS_Shape& part, const Change& change) {
    if (part.IsNull()) return;
    const auto found = known_.find(part.TShape().get());
    if (found == known_.end()) return;
    for (const auto& at : found->second) {
      PartLabel& label = labels_[at];
      label.kind = at.first;
      label.index = at.second;
      change(label);
    }
  }

  std::vector<PartLabel> labels() const {
    std::vector<PartLabel> all;
    for (const auto& [at, label] : labels_) {
      if (!label.name.empty() || !label.product.empty() || label.colour) all.push_back(label);
    }
    return all;
  }

 private:
  using At = std::pair<TopAbs_ShapeEnum, std::uint32_t>;
  std::map<const void*, std::vector<At>> known_;
  std::map<At, PartLabel> labels_;
};

void read_colours(XSControl_Reader& reader, const Handle(Transfer_TransientProcess) & process, Parts& parts) {
  STEPConstruct_Styles styles(reader.WS());
  if (!styles.LoadStyles()) return;
  for (int i = 1; i <= styles.NbStyles(); ++i) {
    const Handle(StepVisual_StyledItem) style = styles.Style(i);
    Handle(StepVisual_Colour) surface, border, curve, rendered;
    Standard_Real transparency = 0;
    Standard_Boolean is_component = Standard_False;
    if (!styles.GetColors(style, surface, border, curve, rendered, transparency, is_component)) continue;
    Quantity_Color colour;
    if (surface.IsNull()) surface = rendered;
    if (surface.IsNull() || !STEPConstruct_Styles::DecodeColor(surface, colour)) continue;
    const Handle(Standard_Transient) item = style->ItemAP242().Value();
    if (item.IsNull()) continue;
    parts.label(TransferBRep::ShapeResult(process, item), [&](PartLabel& label) {
      label.colour = Colour{static_cast<float>(colour.Red()), static_cast<float>(colour.Green()),
                            static_cast<float>(colour.Blue())};
    });
  }
}

}  // namespace

std::vector<PartLabel> labels_of(XSControl_Reader& reader, const TopoDS_Shape& whole) {
  Parts parts(whole);
  const Handle(Transfer_TransientProcess) process = reader.WS()->TransferReader()->TransientProcess();
  const Handle(Interface_InterfaceModel) model = reader.WS()->Model();
  for (int i = 1; i <= model->NbEntities(); ++i) {
    const Handle(Standard_Transient) entity = model->Value(i);
    if (const auto product = Handle(StepBasic_ProductDefinition)::DownCast(entity); !product.IsNull()) {
      if (product->Formation().IsNull() || product->Formation()->OfProduct().IsNull()) continue;
      const std::string name = text_of(product->Formation()->OfProduct()->Name());
      parts.label(TransferBRep::ShapeResult(process, product),
                  [&](PartLabel& label) { label.product = name; });
    } else if (const std::string name = name_of(entity); !name.empty()) {
      parts.label(TransferBRep::ShapeResult(process, entity), [&](PartLabel& label) { label.name = name; });
    }
  }
  read_colours(reader, process, parts);
  return parts.labels();
}

std::vector<LabelledPart> parts_of(const TopoDS_Shape& whole, const std::vector<PartLabel>& labels) {
  std::map<TopAbs_ShapeEnum, TopTools_IndexedMapOfShape> all;
  std::vector<LabelledPart> parts;
  for (const PartLabel& label : labels) {
    const auto [found, is_new] = all.try_emplace(label.kind);
    if (is_new) TopExp::MapShapes(whole, label.kind, found->second);
    const auto count = static_cast<std::uint32_t>(found->second.Extent());
    if (label.index < 1 || label.index > count) continue;
    parts.push_back({found->second(static_cast<int>(label.index)), label});
  }
  return parts;
}

FaceNames::FaceNames(const TopoDS_Shape& whole, const std::vector<PartLabel>& labels) {
  for (const auto& [part, label] : parts_of(whole, labels)) {
    if (label.kind != TopAbs_FACE || label.name.empty()) continue;
    at_.Bind(part, static_cast<int>(names_.size()));
    names_.push_back(label.name);
  }
}

std::string FaceNames::of(const TopoDS_Shape& face) const {
  return at_.IsBound(face) ? names_[static_cast<std::size_t>(at_.Find(face))] : std::string();
}

}  // namespace handloft::exchange::detail
