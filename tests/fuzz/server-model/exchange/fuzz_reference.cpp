// Any bytes as a reference mesh (A28): refused or a mesh that keeps its promises, never a crash. The first
// byte chooses the format; a glTF finds the rest of the file behind a NUL as the buffer it names.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "server-model/exchange/reference_import.h"

namespace {

void require(bool good) {
  if (!good) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using handloft::exchange::ReferenceFormat;
  if (size == 0) return 0;
  constexpr std::array formats{ReferenceFormat::obj, ReferenceFormat::stl, ReferenceFormat::ply,
                               ReferenceFormat::gltf, ReferenceFormat::glb};
  const ReferenceFormat format = formats[data[0] % formats.size()];
  std::span<const std::byte> content = std::as_bytes(std::span(data, size)).subspan(1);
  std::vector<std::byte> buffer;
  if (format == ReferenceFormat::gltf) {
    const auto nul = std::find(content.begin(), content.end(), std::byte{0});
    if (nul != content.end()) buffer.assign(nul + 1, content.end());
    content = content.first(static_cast<std::size_t>(nul - content.begin()));
  }
  handloft::exchange::ReferenceOptions options;
  options.max_vertices = 10'000;
  options.max_triangles = 10'000;
  const auto mesh = handloft::exchange::parse_reference(
      content, format, options,
      [&](const std::string&, std::size_t most) -> handloft::Result<std::vector<std::byte>> {
        require(buffer.size() <= most);
        return buffer;
      });
  if (!mesh) {
    require(!mesh.error().message.empty() && mesh.error().field == "path");
    return 0;
  }
  require(!mesh->indices.empty() && mesh->indices.size() % 3 == 0 &&
          mesh->indices.size() / 3 <= options.max_triangles);
  require(mesh->positions.size() <= options.max_vertices);
  for (const auto& position : mesh->positions) {
    require(position.allFinite() && position.cwiseAbs().maxCoeff() <= 1.001 * options.max_coordinate_m);
  }
  for (const std::uint32_t index : mesh->indices) require(index < mesh->positions.size());
  return 0;
}
