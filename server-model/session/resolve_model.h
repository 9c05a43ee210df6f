#pragma once
// The import of a CAD model made into what a document can apply and a log can store. Not for others than
// resolve_operation.

#include "common/base/result.h"
#include "proto/operation.pb.h"
#include "server-model/model/limits.h"
#include "server-model/session/resolve_operation.h"

namespace handloft::model {

/// As resolve_operation() says of import_model.
Result<handloft::v1::Operation> resolve_model(const handloft::v1::Operation& operation,
                                              const FileAccess& files, const Limits& limits);

}  // namespace handloft::model
