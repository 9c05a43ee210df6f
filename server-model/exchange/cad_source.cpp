#include "server-model/exchange/cad_source.h"

#include <fmt/format.h>

#include <IFSelect_ReturnStatus.hxx>
#include <IGESData_GlobalSection.hxx>
#include <IGESData_IGESEntity.hxx>
#include <IGESData_IGESModel.hxx>
#include <Interface_Check.hxx>
#include <Interface_InterfaceModel.hxx>
#include <Interface_Static.hxx>
#include <STEPControl_Reader.hxx>
#include <StepRepr_RepresentationItem.hxx>
#include <TColStd_SequenceOfAsciiString.hxx>
#include <TCollection_AsciiString.hxx>
#include <TCollection_HAsciiString.hxx>
#include <XSControl_WorkSession.hxx>
#include <algorithm>
#include <fstream>
#include <sstream>
#include <string_view>

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

/// Whether the shape depends on what the entity says.
bool is_geometry(const Handle(Standard_Transient) & entity) {
  if (const Handle(IGESData_IGESEntity) iges = Handle(IGESData_IGESEntity)::DownCast(entity);
      !iges.IsNull()) {
    constexpr int first_curve = 100;  // From 200 on: annotations, then structures, properties and views.
    constexpr int last_solid = 199;
    return iges->TypeNumber() >= first_curve && iges->TypeNumber() <= last_solid;
  }
  if (!entity->IsKind(STANDARD_TYPE(StepRepr_RepresentationItem))) return false;
  const std::string_view type = entity->DynamicType()->Name();
  return type.starts_with("StepGeom_") || type.starts_with("StepShape_");
}

/// The library says what it cannot read of an entity, leaves that empty, and may fall over it later.
Status check_entities(XSControl_Reader& reader, std::vector<std::string>& notes) {
  const Handle(Interface_InterfaceModel) model = reader.WS()->Model();
  std::size_t damaged = 0;
  std::size_t left_out = 0;
  std::string first_damaged;
  std::string first_left_out;
  for (int i = 1; i <= model->NbEntities(); ++i) {
    const Handle(Interface_Check) check = model->Check(i, /*syntactic=*/Standard_True);
    if (check.IsNull() || !check->HasFailed()) continue;
    // A record that cannot be read at all stands in the model as a report of what it was.
    const Handle(Standard_Transient) entity = model->Value(i);
    const bool geometry = is_geometry(entity);
    std::string& first = geometry ? first_damaged : first_left_out;
    if (++(geometry ? damaged : left_out) > 1) continue;
    const Handle(TCollection_HAsciiString) label = model->StringLabel(entity);
    first = fmt::format("{}: {}", label.IsNull() ? "" : label->ToCString(), check->CFail(1));
  }
  if (damaged > 0) {
    return make_error(ErrorCode::data_corrupt,
                      fmt::format("found {} geometric entities that are damaged ({}), expected sound ones",
                                  damaged, first_damaged),
                      "path");
  }
  if (left_out > 0) {
    notes.push_back(fmt::format("left out {} {} besides the geometry that cannot be read, the first is {}",
                                left_out, left_out == 1 ? "entity" : "entities", first_left_out));
  }
  return {};
}

/// What the file leaves to us to guess of its unit of length, or has readers easily get wrong.
void note_unit(XSControl_Reader& reader, std::vector<std::string>& notes) {
  std::vector<std::string> units;
  if (auto* const step = dynamic_cast<STEPControl_Reader*>(&reader)) {
    TColStd_SequenceOfAsciiString lengths;
    TColStd_SequenceOfAsciiString angles;
    TColStd_SequenceOfAsciiString solid_angles;
    step->FileUnits(lengths, angles, solid_angles);
    for (const TCollection_AsciiString& unit : lengths) units.emplace_back(unit.ToCString());
  } else if (const Handle(IGESData_IGESModel) iges = Handle(IGESData_IGESModel)::DownCast(reader.Model());
             !iges.IsNull() && iges->GlobalSection().UnitValue() > 0) {
    units.emplace_back("known");
  }
  std::sort(units.begin(), units.end());
  units.erase(std::unique(units.begin(), units.end()), units.end());
  if (units.empty()) {
    notes.emplace_back("the file names no unit of length that is known: it is taken to be in millimetres");
  } else if (units.size() > 1) {
    notes.push_back(
        fmt::format("the file has parts in several units of length ({})", fmt::join(units, ", ")));
  }
}

}  // namespace

const char* words(CadFormat format) {
  return format == CadFormat::step ? "a STEP" : "an IGES";
}

Result<WholeCad> read_whole(XSControl_Reader& reader, const std::filesystem::path& path, CadFormat format) {
  if (Status end = check_end(path, format); !end) return end.error();
  Interface_Static::SetCVal("xstep.cascade.unit", "MM");
  WholeCad whole;
  const auto read = reader.ReadFile(path.c_str());
  if (read == IFSelect_RetDone) {
    if (Status sound = check_entities(reader, whole.notes); !sound) return sound.error();
  }
  if (read != IFSelect_RetDone || reader.TransferRoots() < 1 || reader.OneShape().IsNull()) {
    return make_error(ErrorCode::data_corrupt,
                      fmt::format("found no shapes, expected {} file", words(format)), "path");
  }
  note_unit(reader, whole.notes);
  whole.shape = reader.OneShape();
  return whole;
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
