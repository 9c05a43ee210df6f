#pragma once
// A model as bytes and back (document_codec.h) is the same model: to the hash of every document of its
// history, its words, and what versions share in memory.

#include <cstdint>
#include <map>
#include <set>
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
  std::set<std::uint64_t> clients;
  for (const History::Entry& entry : before.entries()) clients.insert(entry.step->info.client_id);
  // All that can be done again, then all that can be taken back, client by client: what is refused is refused
  // in both.
  const auto differ = [&](Result<std::string> (History::*step)(std::uint64_t, const Limits&)) -> std::string {
    for (const std::uint64_t client : clients) {
      for (bool more = true; more;) {
        const auto words = (before.*step)(client, {}), same = (after.*step)(client, {});
        if (words.ok() != same.ok()) return "only one of them steps";
        if (words ? *words != *same : words.error().message != same.error().message)
          return "words of a step differ";
        if (document_hash(before.current()) != document_hash(after.current()))
          return "hashes differ with " + std::to_string(before.undo_steps()) + " steps applied";
        more = words.ok();
      }
    }
    return {};
  };
  if (document_hash(before.current()) != document_hash(after.current())) return "hashes differ";
  if (std::string broken = differ(&History::redo); !broken.empty()) return broken;
  return differ(&History::undo);
}

}  // namespace handloft::model::test
