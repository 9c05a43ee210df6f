#include "server-model/exchange/cad_source.h"

#include <fmt/format.h>

#include <IFSelect_ReturnStatus.hxx>
#include <IGESData_IGESEntity.hxx>
#include <Interface_Check.hxx>
#include <Interface_InterfaceModel.hxx>
#include <Interface_Static.hxx>
#include <StepRepr_RepresentationItem.hxx>
#include <TCollection_AsciiString.hxx>
#include <TCollection_HAsciiString.hxx>
#include <XSControl_WorkSession.hxx>
#include <algorithm>
#include <fstream>
#include <sstream>

namespace handloft::exchange::detail {

namespace {

constexpr std::streamoff tail_bytes = 1 << 16;  ///< Signatures may follow the last words.

Result<std::string> tail_of(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary | std::ios::ate);
  const std::streamoff size = stream ? std::streamoff(stream.tellg()) : -1;
  if (size < 0) return make_error(ErrorCode::io, "the file cannot be read", "path");
  std::string tail(static_cast<std::size_t>(std::min(size, tail_bytes)), '\0');
  stream.seekg(size - static_cast<std::streamoff>(tail.size()));
  if (!tail.empty() && !stream.read(tail.data(), static_cast<std::streamsize>(tail.size()))) {
    return make_error(ErrorCode::io, "the file cannot be read", "path");
  }
  return tail;
}

/// IGES ends in a line whose column 73 says so.
bool has_terminate_section(const std::string& tail) {
  constexpr std::size_t section_column = 72;
  std::istringstream lines(tail);
  for (std::string line; std::getline(lines, line);) {
    if (line.size() > section_column && line[section_column] == 'T') return true;
  }
  return false;
}

Status check_end(const std::filesystem::path& path, CadFormat format) {
  const auto tail = tail_of(path);
  if (!tail) return tail.error();
  const bool is_whole = format == CadFormat::step ? tail->find("END-ISO-10303-21") != std::string::npos
                                                  : has_terminate_section(*tail);
  if (is_whole) return {};
  return make_error(
      ErrorCode::data_corrupt,
      fmt::format("found no end of {0} file, expected {1}: it is cut off or no {2} file", words(format),
                  format == CadFormat::step ? "the words END-ISO-10303-21" : "a last line of section T",
                  format == CadFormat::step ? "STEP" : "IGES"),
      "path");
}

/// The library notes what it cannot read of an entity, leaves that empty, and may fall over it later.
Status check_entities(XSControl_Reader& reader) {
  const Handle(Interface_InterfaceModel) model = reader.WS()->Model();
  std::size_t failed = 0;
  std::string first;
  for (int i = 1; i <= model->NbEntities(); ++i) {
    const Handle(Interface_Check) check = model->Check(i, /*syntactic=*/Standard_True);
    if (check.IsNull() || !check->HasFailed()) continue;
    if (++failed > 1) continue;
    const Handle(TCollection_HAsciiString) label = model->StringLabel(model->Value(i));
    first = fmt::format("{}: {}", label.IsNull() ? "" : label->ToCString(), check->CFail(1));
  }
  if (failed == 0) return {};
  return make_error(
      ErrorCode::data_corrupt,
      fmt::format("found {} entities that are damaged ({}), expected sound ones", failed, first), "path");
}

}  // namespace

const char* words(CadFormat format) {
  return format == CadFormat::step ? "a STEP" : "an IGES";
}

Result<TopoDS_Shape> read_whole(XSControl_Reader& reader, const std::filesystem::path& path,
                                CadFormat format) {
  if (Status end = check_end(path, format); !end) return end.error();
  Interface_Static::SetCVal("xstep.cascade.unit", "MM");
  const auto read = reader.ReadFile(path.c_str());
  if (read == IFSelect_RetDone) {
    if (Status sound = check_entities(reader); !sound) return sound.error();
  }
  if (read != IFSelect_RetDone || reader.TransferRoots() < 1 || reader.OneShape().IsNull()) {
    return make_error(ErrorCode::data_corrupt,
                      fmt::format("found no shapes, expected {} file", words(format)), "path");
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
