#pragma once
// What the sculpting operations share (D1 - D20): the entity by its id, icons by theirs, and settling a
// surface under its icons.

#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "proto/operation.pb.h"
#include "server-model/model/document.h"
#include "server-model/model/operations/transform.h"
#include "server-model/model/sculpt_shape.h"

namespace handloft::model {

/// The entity, which must be a sculpted surface: not_found, or invalid_argument when it is of another kind.
Result<SculptPtr> require_sculpt(const Document& document, std::string_view id, std::string_view field);
/// The icon's index; not_found names the field.
Result<std::size_t> require_icon(const SculptShape& shape, std::string_view icon, std::string_view field);

/// Puts a changed surface in the place of the former one of its id.
void put(Document& document, SculptShape shape);

/// A new surface at rest: initial, rest and present shape are the same, parameters scaled to metres (D2), its
/// trim with them.
void set_at_rest(SculptShape& shape, geometry::BSplineSurface surface, FaceTrim trim = {});

/// The surface moved by a similarity, with its icons and what they hold; parameters scale along (D2). Errors:
/// invalid_argument when something would leave the workspace.
Result<SculptShape> moved(const SculptShape& shape, const Similarity& similarity, std::string_view field,
                          const Limits& limits);

/// Knots inserted into the longest spans until there are as many control points in each direction, 0: as
/// there are. Errors: invalid_argument with `field` beyond limits.
Result<geometry::BSplineSurface> refined(const geometry::BSplineSurface& surface, std::uint32_t control_u,
                                         std::uint32_t control_v, const std::string& field,
                                         const Limits& limits);

/// The surface that a message makes, with its id and name; `message` gets the id. Not yet in the document.
Result<SculptShape> make_sculpt_surface(const Document& document,
                                        const handloft::v1::CreateSculptSurface& request,
                                        const std::string& field, const ApplyContext& context,
                                        std::vector<std::string>& notes);

}  // namespace handloft::model
