#pragma once
// Meshes around which shapes are designed (A28, fig. 13): OBJ, STL, PLY, glTF and GLB, and STEP and IGES
// tessellated through Open CASCADE. What comes out is in the world: metres, +Z up, every coordinate a number
// that a float holds, duplicate vertices welded, triangles without area left out.
//
// Units: glTF is metres and +Y up by its standard and always turned; STEP and IGES say their unit. OBJ, STL
// and PLY say neither: metres and +Z up (as ours are written) unless told otherwise.
//
// Nothing but the named file is read, with one exception: a .gltf may name buffers beside it by a plain file
// name (no folder, no link, no scheme but "data:"); their sizes count. Materials, images, animations and
// extensions are not looked at.
//
// The mesh formats have readers of our own, reference_*.cpp: Assimp 5.2.5 wrote beyond its memory within
// minutes of our fuzzer (fuzz_reference) in OBJ files and in cutting polygons, and a server must outlive a
// bad file.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "server-model/geometry/types.h"

namespace handloft::exchange {

enum class ReferenceFormat { obj, stl, ply, gltf, glb, step, iges };

enum class UpAxis { z, y };

struct ReferenceOptions {
  /// Metres per unit of OBJ, STL and PLY; 0: 1. Formats that know their unit are scaled by it on top.
  double scale = 0;
  UpAxis up = UpAxis::z;                                ///< y: the file's +Y becomes our +Z (glTF: always).
  geometry::Vec3 translation = geometry::Vec3::Zero();  ///< Added last, metres.

  std::size_t max_file_bytes = 128U << 20U;  ///< With the buffers beside it; twice the triangles as text.
  std::size_t max_vertices = 300'000;        ///< After welding; six times as many before. As model::Limits.
  std::size_t max_triangles = 600'000;
  double max_coordinate_m = 1e4;  ///< As model::Limits.
  /// Vertices nearer than this part of the mesh's diagonal become one. 1e-6 is 0.4 um on a hand-sized part:
  /// above the rounding of floats and of a CAD kernel's edges, below what any scanner sees.
  double weld_tolerance = 1e-6;
  /// Of the triangles from STEP and IGES surfaces: a tenth of a millimetre as TessellationOptions, or
  /// `chord_fraction` of the diagonal where that is larger, so that a car does not take millions.
  double chord_tolerance_m = 1e-4;
  double chord_fraction = 2e-5;
};

struct ImportedReference {
  std::vector<geometry::Vec3> positions;  ///< World, metres; each value exactly a float.
  std::vector<std::uint32_t> indices;     ///< Three a triangle, as the file winds them.
  std::size_t welded_vertices = 0;        ///< How many were duplicates.
  std::size_t dropped_triangles = 0;      ///< How many had no area.
  geometry::Vec3 lower = geometry::Vec3::Zero(), upper = geometry::Vec3::Zero();
};

/// By the extension: .obj .stl .ply .gltf .glb .step .stp .iges .igs, in any case. Errors: unsupported.
Result<ReferenceFormat> reference_format(const std::filesystem::path& path);

/// Reads a file. Errors, all with the field "path" and a message that begins with the file's name: not_found,
/// io, unsupported (extension, compressed or sparse glTF), data_corrupt (not such a file; numbers that are
/// not finite; indices out of range; no triangle), resource_exhausted (size, vertices, triangles),
/// permission_denied (a buffer that is not beside the file), invalid_argument ("scale": options out of
/// range).
Result<ImportedReference> import_reference(const std::filesystem::path& path,
                                           const ReferenceOptions& options = {});

/// Finds the content of a buffer that a .gltf names, at most `max_bytes` of it.
using FindBuffer =
    std::function<Result<std::vector<std::byte>>(const std::string& name, std::size_t max_bytes)>;

/// The same from memory, for all formats but STEP and IGES (unsupported: Open CASCADE reads files). Without
/// `find_buffer` a glTF that names buffers is permission_denied.
Result<ImportedReference> parse_reference(std::span<const std::byte> content, ReferenceFormat format,
                                          const ReferenceOptions& options = {},
                                          const FindBuffer& find_buffer = {});

}  // namespace handloft::exchange
