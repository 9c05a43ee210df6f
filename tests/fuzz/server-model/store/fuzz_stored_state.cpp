// Any bytes as a snapshot (F1): refused in words, or a state that encodes and decodes to the same document.
// The input is a sequence of chunks, each a three-byte little-endian length and its bytes: the manifest, then
// parts that it may name by their SHA-256.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "server-model/model/canonical.h"
#include "server-model/model/content_hash.h"
#include "server-model/model/document_codec.h"

namespace {

namespace model = handloft::model;
using Parts = std::map<std::string, std::string>;

void require(bool good) {
  if (!good) std::abort();
}

model::FetchPart from(const Parts& parts) {
  return [&parts](std::string_view sha256) -> handloft::Result<std::string> {
    const auto part = parts.find(std::string(sha256));
    if (part == parts.end()) return handloft::make_error(handloft::ErrorCode::not_found, "no such part");
    return part->second;
  };
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t head = 3;
  std::vector<std::string> chunks;
  while (size >= head) {
    const std::size_t promised = data[0] + std::size_t{0x100} * data[1] + std::size_t{0x10000} * data[2];
    const std::size_t length = std::min(promised, size - head);
    chunks.emplace_back(reinterpret_cast<const char*>(data + head), length);
    data += head + length;
    size -= head + length;
  }
  if (chunks.empty()) return 0;
  Parts parts;
  for (std::size_t i = 1; i < chunks.size(); ++i)
    parts[std::string(model::as_bytes(model::content_hash(chunks[i])))] = chunks[i];
  const auto state = model::decode_state(chunks[0], from(parts));
  if (!state) {
    require(!state.error().message.empty());
    return 0;
  }
  const std::string hash = model::document_hash(state->history.current());
  Parts again;
  const auto encoded =
      model::encode_state(*state, [&](std::string_view sha256, std::string_view bytes) -> handloft::Status {
        again[std::string(sha256)] = std::string(bytes);
        return {};
      });
  require(encoded.ok());
  const auto decoded = model::decode_state(*encoded, from(again));
  require(decoded.ok() && decoded->sequence == state->sequence);
  require(model::document_hash(decoded->history.current()) == hash);
  return 0;
}
