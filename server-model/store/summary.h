#pragma once
// What a file says of its model without restoring it, for lists: how many operations, since when and until
// when, its named versions and alternatives (U6). Versions and alternatives are what the operations made of
// the model; the newest snapshot has them, and each operation's answer says whether it changed any. Only
// where one behind the snapshot did, the model is restored (recovery.h). Checks no more than it reads:
// whether all is good says log_check.h.

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "server-model/model/model.h"
#include "server-model/store/operation_log.h"

namespace handloft::store {

struct NamedVersion {
  std::string name, note, author, alternative;
  std::int64_t made_ns = 0;    ///< ns since 1970, UTC; 0: unknown.
  std::uint64_t sequence = 0;  ///< Of the operation that named it.
};

struct NamedAlternative {
  std::string name;
  std::string version;  ///< It is at; empty: none.
};

struct Summary {
  std::uint64_t operations = 0;
  std::int64_t created_ns = 0;
  std::int64_t changed_ns = 0;          ///< Of the last operation; without one, created_ns.
  std::uint64_t snapshot_sequence = 0;  ///< 0: there is no snapshot.
  std::vector<NamedVersion> versions;   ///< Ascending by sequence.
  std::vector<NamedAlternative> alternatives;
  bool restored = false;  ///< It took the model to know them.
};

/// Of a model that is there, in the order of Summary.
std::vector<NamedVersion> named_versions(const model::Document& document);
std::vector<NamedAlternative> named_alternatives(const model::Document& document);

/// O(the snapshot's manifest + answers behind it); of a file without a snapshot all answers. Errors:
/// data_corrupt, io; where the model must be restored those of recover().
Result<Summary> summarize(const OperationLog& log, const model::ApplyContext& context = {});

}  // namespace handloft::store
