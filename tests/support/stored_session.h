#pragma once
// A session of real operations for tests of the log: its records, and the hash of the document after each.

#include <cstdint>
#include <string>
#include <vector>

#include "server-model/model/document_codec.h"
#include "server-model/model/model.h"
#include "server-model/store/operation_log.h"

namespace handloft::test {

struct StoredSession {
  std::vector<store::LogRecord> records;  ///< Sequence 1, 2, ...
  std::vector<std::string> hashes;        ///< hashes[s] after operation s; hashes[0] of the empty document.
  model::StoredState middle;              ///< After operation records.size() / 2.
};

/// `operations` of several clients: points, fits, names, undo and redo, one in three retryable.
StoredSession stored_session(std::size_t operations, std::uint64_t seed);

}  // namespace handloft::test
