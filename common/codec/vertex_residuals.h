#pragma once
// Quantised vertices as what is left of them when each is predicted from those before it, packed with
// Zstandard (RFC 8878). A surface's vertices lie in rows of a grid, where a vertex is nearly its left
// neighbour plus the step that the row above takes there ("Lorenzo predictor": Ibarria et al., "Out-of-core
// Compression and Decompression of Large n-dimensional Scalar Fields", Eurographics 2003); the first row and
// column, and vertices in no rows, go straight on. Nothing is lost. proto/PROTOCOL.md, "Meshes", has the
// layout.

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"

namespace handloft::codec {

struct QuantisedVertices {
  std::vector<std::array<std::uint16_t, 3>> positions;
  std::vector<std::array<std::int16_t, 2>> normals;  ///< As many; octahedral.
};

/// `row`: vertices a row, 0 for no rows. Precondition: as many normals as positions, and no more in a row.
std::string pack_residuals(const QuantisedVertices& vertices, std::uint32_t row);

/// `count` vertices from bytes that may come from anybody. Errors: data_corrupt, naming `residuals` or `row`.
Result<QuantisedVertices> unpack_residuals(std::string_view bytes, std::size_t count, std::uint32_t row);

}  // namespace handloft::codec
