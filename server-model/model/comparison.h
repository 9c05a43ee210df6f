#pragma once
// What differs between two alternatives of a design (A28): which entities were added, removed or changed, and
// by how much.

#include <vector>

#include "common/base/result.h"
#include "proto/query.pb.h"
#include "server-model/model/document.h"

namespace handloft::model {

/// What the present alternative has that the named one has not ("added"), the other way round ("removed"),
/// and what is not the same in both, by id. Distances between surfaces are measured along the normal of the
/// present one's frame, from a grid over its footprint; where the other surface is not met along it, the
/// place is left out. Errors: not_found for an unknown alternative.
Result<handloft::v1::QueryResult> compare(const handloft::v1::CompareQuery& query, const Document& document);

/// The same of what two documents hold: `now` has it, `then` has not ("added") and so on.
std::vector<handloft::v1::EntityDifference> compare_entities(const Entities& now, const Entities& then);

}  // namespace handloft::model
