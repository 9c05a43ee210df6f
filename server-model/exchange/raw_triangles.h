#pragma once
// What a file holds before it is placed in the world, and how it gets there. Not for others than reference_*.

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "server-model/exchange/reference_import.h"

namespace handloft::exchange::detail {

/// In the file's units and axes, unchecked.
struct RawTriangles {
  std::vector<geometry::Vec3> positions;
  std::vector<std::uint32_t> indices;
};

/// Cuts a polygon of vertices that exist into triangles and appends them: ears in the plane of Newell's
/// normal (concave ones too); a fan where it crosses itself. Corners may lie anywhere, beyond all numbers
/// too.
void append_polygon(std::span<const std::uint32_t> corners, RawTriangles& into);

/// How many vertices a file may hold before duplicates are welded: STL has six a vertex.
std::size_t max_raw_vertices(const ReferenceOptions& options);

/// resource_exhausted when there are more than the options allow.
Status check_counts(std::size_t vertices, std::size_t triangles, const ReferenceOptions& options);

/// Checked, scaled, turned, rounded to floats, welded and cleaned. Errors: data_corrupt, resource_exhausted.
Result<ImportedReference> place_in_world(const RawTriangles& raw, double metres_per_unit, UpAxis up,
                                         const ReferenceOptions& options);

// The readers of each format. Whatever the bytes are: data_corrupt, unsupported, resource_exhausted or
// triangles whose indices are in range, in memory bounded by the content and the options.

Result<RawTriangles> read_obj(std::span<const std::byte> content, const ReferenceOptions& options);
Result<RawTriangles> read_stl(std::span<const std::byte> content, const ReferenceOptions& options);
Result<RawTriangles> read_ply(std::span<const std::byte> content, const ReferenceOptions& options);
/// Both kinds of glTF; also permission_denied, as parse_reference().
Result<RawTriangles> read_gltf(std::span<const std::byte> content, ReferenceFormat format,
                               const ReferenceOptions& options, const FindBuffer& find_buffer);

/// STEP or IGES, metres. Errors: data_corrupt, resource_exhausted, internal (the CAD kernel).
Result<RawTriangles> tessellate_cad_file(const std::filesystem::path& path, ReferenceFormat format,
                                         const ReferenceOptions& options);

}  // namespace handloft::exchange::detail
