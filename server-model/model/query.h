#pragma once
// Answers to the questions of proto/query.proto: pure functions of the document and its history.

#include <cstdint>
#include <functional>
#include <string_view>

#include "common/base/result.h"
#include "proto/query.pb.h"
#include "server-model/model/document.h"
#include "server-model/model/history.h"

namespace handloft::model {

/// An entity's revision as viewers know it (Model::revision).
using RevisionOf = std::function<std::uint64_t(std::string_view id)>;

/// As `client_id` sees it: its own undo and redo. not_found for an unknown entity, failed_precondition for
/// the surface of an unfitted one, invalid_argument for an empty query or coordinates that are not finite.
Result<handloft::v1::QueryResult> answer(const handloft::v1::Query& query, const Document& document,
                                         const History& history, const RevisionOf& revision,
                                         const Limits& limits = {}, std::uint64_t client_id = 0);

}  // namespace handloft::model
