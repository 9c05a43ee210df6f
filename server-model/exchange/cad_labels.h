#pragma once
// What files say of the parts of a model beside their shape: the names of products, solids, shells and faces,
// and their colours. STEP has all of these, IGES a label of eight characters for each face and its colour.
// Not for others than cad_* and the writers.
//
// The library's own way (its documents of XCAF) would bring its display libraries into the server; these few
// entities are as easily read and written themselves.

#include <TopAbs_ShapeEnum.hxx>
#include <TopTools_DataMapOfShapeInteger.hxx>
#include <TopoDS_Shape.hxx>
#include <XSControl_Reader.hxx>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace handloft::exchange::detail {

using Colour = std::array<float, 3>;  ///< Linear red, green, blue, 0..1, as the library has them.

/// Of a part of a model.
struct PartLabel {
  TopAbs_ShapeEnum kind = TopAbs_FACE;
  std::uint32_t index = 0;  ///< In TopExp::MapShapes() of the whole for the kind, from 1.
  std::string name;         ///< Of the part itself; may be empty, as the next.
  std::string product;      ///< Of the product whose shape it is.
  std::optional<Colour> colour;
};

/// A part of a shape that is written.
struct LabelledPart {
  TopoDS_Shape shape;
  PartLabel label;
};

/// What the file says of the parts of what was read from it, `whole`. Throws the library's exceptions.
std::vector<PartLabel> labels_of(XSControl_Reader& reader, const TopoDS_Shape& whole);

/// The parts that the labels are of; those of which there is none are left out.
std::vector<LabelledPart> parts_of(const TopoDS_Shape& whole, const std::vector<PartLabel>& labels);

/// The names of a model's faces.
class FaceNames {
 public:
  FaceNames(const TopoDS_Shape& whole, const std::vector<PartLabel>& labels);
  std::string of(const TopoDS_Shape& face) const;  ///< Empty when it has none.

 private:
  TopTools_DataMapOfShapeInteger at_;
  std::vector<std::string> names_;
};

}  // namespace handloft::exchange::detail
