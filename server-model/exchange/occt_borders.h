#pragma once
// The edges of faces that got another surface: shared with a neighbour as far as the two moved alike, and
// otherwise each face's own. Not for others than occt_replace.
//
// An edge has the same parameter on both of its faces, so "alike" is asked place by place: how far did each
// face's image of the place move, and do the two movements differ by more than the tolerance? A face that
// nobody changed moved by nothing. So neighbours that hold their border keep the edge that they had, to the
// bit; neighbours that moved it together share one new edge; and only the others come apart.

#include <Geom_BSplineSurface.hxx>
#include <TopoDS_Face.hxx>
#include <cstdint>
#include <vector>

#include "common/base/result.h"

namespace handloft::exchange::detail {

/// All in the model's units.
struct ChangedFace {
  std::uint32_t number = 0;
  TopoDS_Face former;  ///< As it lies in the model, forward.
  Handle(Geom_BSplineSurface) before, after;
  TopoDS_Face made;  ///< What stands in its place, forward: set by lay_borders().
};

/// Two faces, by number, that shared an edge and do no longer; the same one twice where it opened along its
/// seam.
struct OpenedEdge {
  std::uint32_t face = 0, neighbour = 0;
  double gap = 0;  ///< The largest difference of their movements along the edge; of all edges of the pair.
};

/// Makes the changed faces; `faces` are all of the model by number, from 1. The edges of untouched faces get
/// larger tolerances at most. A face that would be invalid within edges that it shares gets its own ones.
/// Answers who came apart, each pair once, ascending. Throws the library's exceptions. Errors:
/// invalid_argument (an edge without a curve in the parameters, a face that is not valid any more), with
/// "face 3: " before the message.
Result<std::vector<OpenedEdge>> lay_borders(const std::vector<TopoDS_Face>& faces, double tolerance,
                                            std::vector<ChangedFace>& changed);

}  // namespace handloft::exchange::detail
