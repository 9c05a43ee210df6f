#pragma once
// A model as bytes and back (document_codec.h) is the same model: to the hash of every document of its
// history, its words, and what versions share in memory.

#include <map>
#include <string>

#include "server-model/model/canonical.h"
#include "server-model/model/document_codec.h"
#include "server-model/model/model.h"

namespace handloft::model::test {

/// Empty: it is the same.
inline std::string broken_round_trip(const Model& model) {
  EncodeOptions options;
  options.min_shared_bytes = 200;  // Some of the parts of small models lie beside.
  std::map<std::string, std::string, std::less<>> beside;
  const TakePart take = [&](std::string_view hash, std::string_view bytes) -> Status {
    beside.insert_or_assign(std::string(hash), std::string(bytes));
    return {};
  };
  const FetchPart fetch = [&](std::string_view hash) -> Result<std::string> {
    const auto found = beside.find(hash);
    if (found == beside.end()) return make_error(ErrorCode::not_found, "part");
    return found->second;
  };
  const auto bytes = encode_state({model.history(), model.sequence()}, take, options);
  if (!bytes) return bytes.error().describe();
  const auto state = decode_state(*bytes, fetch);
  if (!state) return state.error().describe();
  // What is shared is shared again: else the same would need more parts or entities.
  if (*encode_state(*state, take, options) != *bytes) return "encoded again it gives other bytes";

  History before = model.history(), after = state->history;
  if (state->sequence != model.sequence() || after.undo_steps() != before.undo_steps()) return "steps differ";
  while (before.redo()) {
    if (!after.redo()) return "less can be redone";
  }
  for (;;) {
    if (document_hash(before.current()) != document_hash(after.current())) {
      return "hashes differ with " + std::to_string(before.undo_steps()) + " steps applied";
    }
    const auto words = before.undo(), same = after.undo();
    if (words.ok() != same.ok() || (words && *words != *same)) return "words of a step differ";
    if (!words) return "";
  }
}

}  // namespace handloft::model::test
