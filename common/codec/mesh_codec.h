#pragma once
// Triangle meshes on the wire: positions in 16 bits within their bounding box, octahedral normals in 2 x 12
// bits (stripes on a surface show the steps of fewer), opacity in 8 bits (A23). Vertices are packed by
// prediction (vertex_residuals.h), triangles with meshoptimizer's index codec. The decoder treats its input
// as hostile: every count is held against a limit and against the bytes that are really there before anything
// is allocated.
//
// Octahedral normals: Cigolle et al., "A Survey of Efficient Representations for Independent Unit Vectors",
// JCGT 2014.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "proto/scene.pb.h"

namespace handloft::codec {

/// A triangle mesh as a display wants it. `normals` and `opacity` are as long as `positions`; `indices` are
/// three a triangle, anticlockwise seen from the side that the normals point to.
struct MeshData {
  std::vector<std::array<float, 3>> positions;  ///< world, metres
  std::vector<std::array<float, 3>> normals;    ///< world, unit
  std::vector<std::uint8_t> opacity;            ///< 255: opaque
  std::vector<std::uint32_t> indices;
  std::uint32_t row = 0;  ///< Vertices a row, where they are the rows of a grid, else 0: they pack better.
};

struct MeshLimits {
  std::size_t max_vertices = std::size_t{1}
                             << 20;  ///< 24 MiB decoded; a tessellated surface has some ten thousand
  std::size_t max_indices = std::size_t{6} << 20;  ///< six a vertex, as in a regular triangle grid
  double max_coordinate_m = 1e4;                   ///< nothing on a table is 10 km away
};

/// The mesh, quantised. Positions come back within half of `step_m` per axis (plus float rounding), normals
/// within a tenth of a degree, opacity and triangles as they were (a triangle's corners may be rotated, its
/// winding is kept). Errors: invalid_argument naming the field for NaN, unequal lengths, an index out of
/// range, a count that is not a multiple of three or more vertices a row than there are; resource_exhausted
/// above the limits.
Result<v1::Mesh> encode_mesh(const MeshData& mesh, const MeshLimits& limits = {});

/// The same for a mesh whose triangles are those of an earlier message: a surface that is dragged. The
/// indices of `mesh` are not looked at. Errors: as above; invalid_argument for another number of vertices.
Result<v1::Mesh> encode_mesh(const MeshData& mesh, const v1::Mesh& same_triangles,
                             const MeshLimits& limits = {});

/// The same mesh, to the bit, as viewers read it that know no residuals (protocol 1.2 and before). Errors:
/// data_corrupt for a message that encode_mesh() has not made.
Result<v1::Mesh> as_vertex_streams(const v1::Mesh& message);

/// Triangles that the receiver has, for messages that leave them out (Mesh.topology).
struct KnownTriangles {
  std::uint64_t topology = 0;  ///< 0: none are known.
  std::span<const std::uint32_t> indices;
};

/// The mesh of a message that may come from anybody. Errors: data_corrupt or resource_exhausted, naming the
/// field; data_corrupt, too, for a message without triangles when they are not those that are known.
Result<MeshData> decode_mesh(const v1::Mesh& message, const MeshLimits& limits = {},
                             const KnownTriangles& known = {});

/// A unit normal as two numbers in -2047..2047 and back. A zero vector counts as +z; what is beyond counts as
/// the ends.
std::array<std::int16_t, 2> encode_octahedral(const std::array<float, 3>& normal);
std::array<float, 3> decode_octahedral(std::int16_t x, std::int16_t y);

}  // namespace handloft::codec
