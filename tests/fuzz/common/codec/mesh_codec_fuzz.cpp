// Any bytes as a Mesh: refused or decoded into something that indexes itself and is the same in the older
// coding, never a crash.

#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "common/codec/mesh_codec.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  handloft::v1::Mesh message;
  if (!message.ParseFromArray(data, static_cast<int>(size))) return 0;
  const auto mesh = handloft::codec::decode_mesh(message);
  if (!mesh) return 0;
  for (const std::uint32_t index : mesh->indices) {
    if (index >= mesh->positions.size()) std::abort();
  }
  const auto plain = handloft::codec::as_vertex_streams(message);
  if (!plain) std::abort();
  const auto same = handloft::codec::decode_mesh(*plain);
  if (!same || same->positions.size() != mesh->positions.size() || same->indices != mesh->indices)
    std::abort();
  if (!handloft::codec::encode_mesh(*mesh, {.max_coordinate_m = 1e5})) std::abort();
  return 0;
}
