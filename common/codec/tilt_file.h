#pragma once
// Strokes drawn in VR: the .tilt file of Tilt Brush and Open Brush (format as published with the Tilt Brush
// toolkit): 16 bytes of header ("tilT"), then a zip archive with metadata.json and data.sketch, which holds
// the strokes as little-endian binary. Read with limits: nothing in a file makes us allocate more than they
// say.

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace handloft::codec {

/// One sample of the hand. Unity's axes: x right, y up, z forward (left-handed); units about a decimetre.
struct TiltControlPoint {
  std::array<float, 3> position{};
  std::array<float, 4> orientation{0, 0, 0, 1};  ///< Quaternion x, y, z, w.
  float pressure = 1.0F;                         ///< 0..1; 1 where the file has none.
  std::uint32_t time_ms = 0;                     ///< 0 where the file has none.
};

struct TiltStroke {
  std::int32_t brush_index = 0;
  std::array<float, 4> color{};  ///< Red, green, blue, alpha, 0..1.
  float brush_size = 0;          ///< File units.
  float scale = 1.0F;
  std::vector<TiltControlPoint> points;
};

struct TiltFile {
  std::int32_t sketch_version = 0;
  std::vector<TiltStroke> strokes;
  std::string metadata_json;  ///< As it stands in the file, not interpreted; empty if there is none.

  std::size_t point_count() const;
};

struct TiltLimits {
  std::size_t max_file_bytes = std::size_t{256} << 20;  ///< Large sketches have some ten megabytes.
  std::size_t max_uncompressed_bytes = std::size_t{512}
                                       << 20;  ///< Per entry, counted while unpacking (zip bombs).
  std::size_t max_strokes = 1'000'000;
  std::size_t max_points = 10'000'000;
};

/// Errors, each with the field ("strokes[2].points[17].pressure"): data_corrupt, unsupported (a newer
/// version), resource_exhausted (a limit). Positions and orientations are finite afterwards and pressures in
/// 0..1.
Result<TiltFile> parse_tilt(std::span<const std::byte> bytes, const TiltLimits& limits = {});

/// The inner binary alone, without zip.
Result<TiltFile> parse_tilt_sketch(std::span<const std::byte> sketch, const TiltLimits& limits = {});

/// Errors also: not_found, io.
Result<TiltFile> read_tilt_file(const std::filesystem::path& path, const TiltLimits& limits = {});

}  // namespace handloft::codec
