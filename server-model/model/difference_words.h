#pragma once
// What was done from one named version to another, in words (U6): "Ann moved seat by 12 mm." By comparing the
// two designs, and with names of those who changed an entity in between where history still knows them.

#include "common/base/result.h"
#include "proto/query.pb.h"
#include "server-model/model/document.h"
#include "server-model/model/history.h"

namespace handloft::model {

/// Errors: not_found for an unknown version. O(points of what differs and steps in between).
Result<handloft::v1::QueryResult> difference_in_words(const handloft::v1::DifferenceQuery& query,
                                                      const Document& document, const History& history);

}  // namespace handloft::model
