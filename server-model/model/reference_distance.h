#pragma once
// How far a shape is from the reference around which it is designed (A28): its points, and its surface where
// it is seen.

#include "common/base/result.h"
#include "proto/query.pb.h"
#include "server-model/model/document.h"

namespace handloft::model {

/// Errors: not_found for an unknown shape or reference; invalid_argument for entities of the wrong kind;
/// failed_precondition where no reference is named and there is not exactly one.
Result<handloft::v1::QueryResult> distance_to_reference(const handloft::v1::DistanceQuery& query,
                                                        const Document& document);

}  // namespace handloft::model
