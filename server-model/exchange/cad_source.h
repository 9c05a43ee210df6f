#pragma once
// What readers of STEP and IGES files have in common. Not for others than cad_import, cad_labels,
// reference_cad and step_reader.

#include <TopoDS_Shape.hxx>
#include <XSControl_Reader.hxx>
#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace handloft::exchange::detail {

constexpr double metres_per_millimetre = 1e-3;

enum class CadFormat { step, iges };
const char* words(CadFormat format);  ///< For messages: "a STEP".

struct WholeCad {
  TopoDS_Shape shape;              ///< In millimetres, whatever the file's unit is.
  std::vector<std::string> notes;  ///< For people: what was guessed or left out.
};

/// The whole of a file. One without its last words was cut off: the library would give what is there of it,
/// and people would miss the rest late. Damaged geometry is refused, for the library would put zeros there;
/// what else is damaged or unknown (dimensions, annotations, properties, names) is left out with a note.
/// Throws the library's exceptions. Errors: data_corrupt, io.
Result<WholeCad> read_whole(XSControl_Reader& reader, const std::filesystem::path& path, CadFormat format);

/// The name that the file gives to what an entity stands for: a STEP item's name, an IGES entity's label;
/// empty when it has none.
std::string name_of(const Handle(Standard_Transient) & entity);

}  // namespace handloft::exchange::detail
