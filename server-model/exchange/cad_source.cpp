#include "server-model/exchange/cad_source.h"

#include <fmt/format.h>

#include <IFSelect_ReturnStatus.hxx>
#include <IGESData_IGESEntity.hxx>
#include <Interface_Static.hxx>
#include <StepRepr_RepresentationItem.hxx>
#include <TCollection_AsciiString.hxx>
#include <TCollection_HAsciiString.hxx>

namespace handloft::exchange::detail {

Result<TopoDS_Shape> read_whole(XSControl_Reader& reader, const std::filesystem::path& path,
                                const char* what) {
  Interface_Static::SetCVal("xstep.cascade.unit", "MM");
  if (reader.ReadFile(path.c_str()) != IFSelect_RetDone || reader.TransferRoots() < 1 ||
      reader.OneShape().IsNull()) {
    return make_error(ErrorCode::data_corrupt, fmt::format("found no shapes, expected {} file", what),
                      "path");
  }
  return reader.OneShape();
}

std::string name_of(const Handle(Standard_Transient) & origin) {
  if (const Handle(StepRepr_RepresentationItem) item = Handle(StepRepr_RepresentationItem)::DownCast(origin);
      !item.IsNull()) {
    return item->Name().IsNull() ? "" : item->Name()->ToCString();
  }
  if (const Handle(IGESData_IGESEntity) entity = Handle(IGESData_IGESEntity)::DownCast(origin);
      !entity.IsNull()) {
    if (!entity->HasShortLabel()) return "";
    TCollection_AsciiString label = entity->ShortLabel()->ToCString();
    label.LeftAdjust();  // IGES fills up with spaces.
    label.RightAdjust();
    return label.ToCString();
  }
  return "";
}

}  // namespace handloft::exchange::detail
