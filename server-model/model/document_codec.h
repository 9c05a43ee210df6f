#pragma once
// A model as bytes and back (proto/storage.proto): what a snapshot of the log holds, so that a restart need
// not replay every operation (U3, D7). All of the document, to the bit of its canonical hash, and as many
// steps of its history as asked for, so that operations after the snapshot may undo what came before. What
// versions of an entity share in memory is written once, and shared again when it is read; large parts are
// named by their SHA-256, so that two snapshots share them too.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "common/base/result.h"
#include "server-model/model/history.h"

namespace handloft::model {

/// What is kept of a model: all but the gestures in the air and the answers to operations.
struct StoredState {
  History history;
  std::uint64_t sequence = 0;
};

/// As much of it as a snapshot keeps: cheaper to have than all of its history.
struct KeptState {
  History::Kept history;
  std::uint64_t sequence = 0;
};

struct EncodeOptions {
  /// Steps that can be undone, of all clients, and as many that can be redone, shared out as History::kept()
  /// says: each of ten who work together keeps a hundred. A thousand are hours of work; an operation that
  /// undoes more is replayed from an older snapshot.
  std::size_t max_steps = 1000;
  /// Parts of at least so many bytes lie beside, shared by snapshots; smaller ones are not worth a row.
  std::size_t min_shared_bytes = 2048;
};

/// Takes a large part: 32 bytes of hash and the content. A failure ends the encoding.
using TakePart = std::function<Status(std::string_view sha256, std::string_view bytes)>;
/// Gives it back. Errors: not_found, data_corrupt.
using FetchPart = std::function<Result<std::string>(std::string_view sha256)>;

/// O(what is kept); reads values that other threads may hold too. Errors: of `take`.
Result<std::string> encode_state(const StoredState& state, const TakePart& take,
                                 const EncodeOptions& options = {});
Result<std::string> encode_state(const KeptState& state, const TakePart& take,
                                 const EncodeOptions& options = {});  ///< Without options.max_steps.

/// Errors: data_corrupt, naming what does not fit; unsupported for a newer version; those of `fetch`.
/// Whatever bytes are given, memory stays in proportion to them and the parts.
Result<StoredState> decode_state(std::string_view bytes, const FetchPart& fetch,
                                 std::size_t max_history_steps = Limits{}.max_history_steps);

}  // namespace handloft::model
