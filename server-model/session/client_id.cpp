#include "server-model/session/client_id.h"

#include "server-model/model/content_hash.h"

namespace handloft::session {

std::uint64_t derived_client_id(std::string_view user, std::string_view key) {
  constexpr unsigned byte_bits = 8;
  constexpr unsigned id_bits = 53;
  constexpr unsigned head_bits = 64;
  model::ContentHash hash;
  hash.add(user).add(std::string_view("\0", 1)).add(key);
  const model::ContentHash::Digest digest = hash.finish();
  std::uint64_t head = 0;
  for (std::size_t i = 0; i < head_bits / byte_bits; ++i) head = (head << byte_bits) | digest[i];
  return (head >> (head_bits - id_bits)) | first_derived_client_id;
}

}  // namespace handloft::session
