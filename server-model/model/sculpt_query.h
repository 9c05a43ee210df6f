#pragma once
// Answers about sculpted surfaces (proto/query.proto): parts of answer() in query.h.

#include "common/base/result.h"
#include "proto/query.pb.h"
#include "server-model/model/document.h"
#include "server-model/model/sculpt_shape.h"

namespace handloft::model {

/// Its icons, its size and, when asked for, its control points. Errors: not_found, invalid_argument (kind).
Result<handloft::v1::QueryResult> sculpt(const handloft::v1::SculptQuery& query, const Document& document);

/// Places and normals at parameters. Errors: invalid_argument for parameters that are not finite,
/// resource_exhausted for too many.
Result<handloft::v1::QueryResult> evaluate_sculpt(const handloft::v1::EvaluateQuery& query,
                                                  const SculptShape& shape, const Limits& limits);

}  // namespace handloft::model
