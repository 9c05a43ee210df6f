#include "common/codec/tilt_file.h"

#include <fmt/format.h>
#include <unzip.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <memory>
#include <optional>
#include <system_error>
#include <type_traits>

namespace handloft::codec {
namespace {

constexpr std::size_t known_header_bytes = 16;
constexpr std::uint32_t sketch_sentinel = 0xc576a5cd;
/// The layout that every version since 5 shares; later ones add extension words, which are skipped by their
/// size.
constexpr std::int32_t oldest_version = 5;
constexpr std::int32_t newest_version = 6;

// Stroke extension bits. Those below 0x10000 hold 4 bytes each, the others a length and as many bytes.
constexpr std::uint32_t stroke_scale = 0x2;
constexpr std::uint32_t fixed_size_extensions = 0xffff;
// Control point extension bits, 4 bytes each.
constexpr std::uint32_t point_pressure = 0x1;
constexpr std::uint32_t point_time = 0x2;

constexpr std::size_t point_bytes = std::size_t{7} * 4;   ///< Position and orientation, without extensions.
constexpr std::size_t stroke_bytes = std::size_t{9} * 4;  ///< Index, colour, size, two masks, point count.

static_assert(std::endian::native == std::endian::little, "the format's byte order is read directly");

/// Reads numbers one after the other and remembers if there were too few bytes.
class Cursor {
 public:
  explicit Cursor(std::span<const std::byte> bytes) : bytes_(bytes) {}

  template <typename T>
  requires std::is_trivially_copyable_v<T> T read() {
    T value{};
    if (bytes_.size() - position_ < sizeof(T)) {
      overrun_ = true;
      position_ = bytes_.size();
      return value;
    }
    std::memcpy(&value, bytes_.data() + position_, sizeof(T));
    position_ += sizeof(T);
    return value;
  }
  void skip(std::size_t count) {
    if (bytes_.size() - position_ < count) {
      overrun_ = true;
      position_ = bytes_.size();
    } else {
      position_ += count;
    }
  }
  std::size_t remaining() const { return bytes_.size() - position_; }
  bool overrun() const { return overrun_; }

 private:
  std::span<const std::byte> bytes_;
  std::size_t position_ = 0;
  bool overrun_ = false;
};

Error ends_early(std::string field) {
  return make_error(ErrorCode::data_corrupt, "the data end in the middle of it", std::move(field));
}

std::string point_field(std::size_t stroke, std::size_t point, std::string_view member) {
  return fmt::format("strokes[{}].points[{}].{}", stroke, point, member);
}

Status read_points(Cursor& cursor, std::size_t stroke_index, std::size_t count, std::uint32_t mask,
                   TiltStroke& stroke) {
  stroke.points.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    TiltControlPoint& point = stroke.points[i];
    for (float& coordinate : point.position) coordinate = cursor.read<float>();
    for (float& component : point.orientation) component = cursor.read<float>();
    for (std::uint32_t rest = mask; rest != 0; rest &= rest - 1) {
      const std::uint32_t bit = rest & (~rest + 1);
      if (bit == point_pressure) {
        point.pressure = cursor.read<float>();
      } else if (bit == point_time) {
        point.time_ms = cursor.read<std::uint32_t>();
      } else {
        cursor.skip(4);
      }
    }
    if (cursor.overrun()) return ends_early(fmt::format("strokes[{}].points[{}]", stroke_index, i));
    const auto finite = [](float x) { return std::isfinite(x); };
    if (!std::all_of(point.position.begin(), point.position.end(), finite)) {
      return make_error(ErrorCode::data_corrupt, "found a coordinate that is not finite",
                        point_field(stroke_index, i, "position"));
    }
    if (!std::all_of(point.orientation.begin(), point.orientation.end(), finite)) {
      return make_error(ErrorCode::data_corrupt, "found a component that is not finite",
                        point_field(stroke_index, i, "orientation"));
    }
    if (!std::isfinite(point.pressure)) {
      return make_error(ErrorCode::data_corrupt, "found a number that is not finite, expected 0..1",
                        point_field(stroke_index, i, "pressure"));
    }
    // Controllers report slightly above 1 at the end of their travel.
    point.pressure = std::clamp(point.pressure, 0.0F, 1.0F);
  }
  return {};
}

Status read_stroke(Cursor& cursor, std::size_t index, const TiltLimits& limits, std::size_t& points_so_far,
                   TiltStroke& stroke) {
  const std::string field = fmt::format("strokes[{}]", index);
  stroke.brush_index = cursor.read<std::int32_t>();
  for (float& channel : stroke.color) channel = cursor.read<float>();
  stroke.brush_size = cursor.read<float>();
  const auto stroke_mask = cursor.read<std::uint32_t>();
  const auto point_mask = cursor.read<std::uint32_t>();
  for (std::uint32_t rest = stroke_mask; rest != 0; rest &= rest - 1) {
    const std::uint32_t bit = rest & (~rest + 1);
    if (bit == stroke_scale) {
      stroke.scale = cursor.read<float>();
    } else if ((bit & fixed_size_extensions) != 0) {
      cursor.skip(4);
    } else {
      cursor.skip(cursor.read<std::uint32_t>());
    }
  }
  const auto count = cursor.read<std::int32_t>();
  if (cursor.overrun()) return ends_early(field);
  const bool finite =
      std::all_of(stroke.color.begin(), stroke.color.end(), [](float x) { return std::isfinite(x); }) &&
      std::isfinite(stroke.brush_size) && std::isfinite(stroke.scale);
  if (!finite) {
    return make_error(ErrorCode::data_corrupt, "found a colour, size or scale that is not finite", field);
  }
  if (count < 0) {
    return make_error(ErrorCode::data_corrupt, fmt::format("found {} points", count), field + ".point_count");
  }
  const auto points = static_cast<std::size_t>(count);
  if (points > limits.max_points - std::min(points_so_far, limits.max_points)) {
    return make_error(
        ErrorCode::resource_exhausted,
        fmt::format("found {} points in all, the limit is {}", points_so_far + points, limits.max_points),
        field + ".point_count");
  }
  const std::size_t bytes_each = point_bytes + 4 * static_cast<std::size_t>(std::popcount(point_mask));
  if (points > cursor.remaining() / bytes_each) {  // Before any memory is asked for.
    return make_error(
        ErrorCode::data_corrupt,
        fmt::format("found {} points, but bytes for {} at most", points, cursor.remaining() / bytes_each),
        field + ".point_count");
  }
  points_so_far += points;
  return read_points(cursor, index, points, point_mask, stroke);
}

// The archive in memory, behind minizip's file functions.
struct MemoryFile {
  std::span<const std::byte> bytes;
  std::size_t position = 0;
};

voidpf open_memory(voidpf opaque, const void*, int) {
  return opaque;
}
uLong read_memory(voidpf, voidpf stream, void* buffer, uLong size) {
  auto& file = *static_cast<MemoryFile*>(stream);
  const std::size_t count = std::min<std::size_t>(size, file.bytes.size() - file.position);
  if (count > 0) std::memcpy(buffer, file.bytes.data() + file.position, count);
  file.position += count;
  return static_cast<uLong>(count);
}
uLong write_memory(voidpf, voidpf, const void*, uLong) {
  return 0;
}
ZPOS64_T tell_memory(voidpf, voidpf stream) {
  return static_cast<MemoryFile*>(stream)->position;
}
long seek_memory(voidpf, voidpf stream, ZPOS64_T offset, int origin) {
  auto& file = *static_cast<MemoryFile*>(stream);
  ZPOS64_T base = 0;
  if (origin == ZLIB_FILEFUNC_SEEK_CUR) base = file.position;
  if (origin == ZLIB_FILEFUNC_SEEK_END) base = file.bytes.size();
  if (offset > file.bytes.size() || base > file.bytes.size() - offset) return -1;
  file.position = static_cast<std::size_t>(base + offset);
  return 0;
}
int close_memory(voidpf, voidpf) {
  return 0;
}
int error_memory(voidpf, voidpf) {
  return 0;
}

struct CloseArchive {
  void operator()(void* archive) const { unzClose(archive); }
};
using Archive = std::unique_ptr<void, CloseArchive>;

/// One entry, unpacked; nullopt if the archive has none of that name.
Result<std::optional<std::vector<std::byte>>> unpack(void* archive, const char* name,
                                                     const TiltLimits& limits) {
  constexpr int case_sensitive = 1;
  if (unzLocateFile(archive, name, case_sensitive) != UNZ_OK) return std::optional<std::vector<std::byte>>{};
  if (unzOpenCurrentFile(archive) != UNZ_OK) {
    return make_error(ErrorCode::data_corrupt, "the archive's entry can't be opened", name);
  }
  std::vector<std::byte> content;
  std::vector<std::byte> chunk(std::size_t{64} << 10);
  int count = 0;
  // The size that the archive states is not believed: what comes out is counted.
  while ((count = unzReadCurrentFile(archive, chunk.data(), static_cast<unsigned>(chunk.size()))) > 0) {
    const auto bytes = static_cast<std::size_t>(count);
    if (bytes > limits.max_uncompressed_bytes - content.size()) {
      unzCloseCurrentFile(archive);
      return make_error(ErrorCode::resource_exhausted,
                        fmt::format("unpacks to more than {} bytes", limits.max_uncompressed_bytes), name);
    }
    content.insert(content.end(), chunk.begin(), chunk.begin() + count);
  }
  const int closed = unzCloseCurrentFile(archive);  // Reports a wrong checksum.
  if (count < 0 || closed != UNZ_OK) {
    return make_error(ErrorCode::data_corrupt, "the archive's entry is damaged", name);
  }
  return std::optional(std::move(content));
}

}  // namespace

std::size_t TiltFile::point_count() const {
  std::size_t count = 0;
  for (const TiltStroke& stroke : strokes) count += stroke.points.size();
  return count;
}

Result<TiltFile> parse_tilt_sketch(std::span<const std::byte> sketch, const TiltLimits& limits) {
  Cursor cursor(sketch);
  const auto sentinel = cursor.read<std::uint32_t>();
  TiltFile file;
  file.sketch_version = cursor.read<std::int32_t>();
  cursor.skip(4);  // Reserved.
  const auto additional_header = cursor.read<std::uint32_t>();
  if (cursor.overrun()) return ends_early("sketch.header");
  if (sentinel != sketch_sentinel) {
    return make_error(ErrorCode::data_corrupt,
                      fmt::format("found {:#010x}, expected {:#010x}", sentinel, sketch_sentinel),
                      "sketch.sentinel");
  }
  if (file.sketch_version < oldest_version || file.sketch_version > newest_version) {
    return make_error(ErrorCode::unsupported,
                      fmt::format("found version {}, expected {} to {}", file.sketch_version, oldest_version,
                                  newest_version),
                      "sketch.version");
  }
  cursor.skip(additional_header);
  const auto count = cursor.read<std::int32_t>();
  if (cursor.overrun()) return ends_early("sketch.header");
  if (count < 0 || static_cast<std::size_t>(count) > cursor.remaining() / stroke_bytes) {
    return make_error(
        ErrorCode::data_corrupt,
        fmt::format("found {} strokes, but bytes for {} at most", count, cursor.remaining() / stroke_bytes),
        "sketch.stroke_count");
  }
  if (static_cast<std::size_t>(count) > limits.max_strokes) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found {} strokes, the limit is {}", count, limits.max_strokes),
                      "sketch.stroke_count");
  }
  file.strokes.resize(static_cast<std::size_t>(count));
  std::size_t points = 0;
  for (std::size_t i = 0; i < file.strokes.size(); ++i) {
    if (Status status = read_stroke(cursor, i, limits, points, file.strokes[i]); !status.ok()) {
      return status.error();
    }
  }
  return file;
}

Result<TiltFile> parse_tilt(std::span<const std::byte> bytes, const TiltLimits& limits) {
  if (bytes.size() > limits.max_file_bytes) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found {} bytes, the limit is {}", bytes.size(), limits.max_file_bytes),
                      "file");
  }
  if (bytes.size() < known_header_bytes || std::memcmp(bytes.data(), "tilT", 4) != 0) {
    return make_error(ErrorCode::data_corrupt, "found no tilT at the start: this is not a .tilt file",
                      "file.header");
  }
  Cursor header(bytes.subspan(4));
  const auto header_bytes = header.read<std::uint16_t>();
  if (header_bytes < known_header_bytes || header_bytes > bytes.size()) {
    return make_error(
        ErrorCode::data_corrupt,
        fmt::format("found a header of {} bytes, expected {}", header_bytes, known_header_bytes),
        "file.header_size");
  }

  MemoryFile memory{bytes.subspan(header_bytes)};
  zlib_filefunc64_def functions{open_memory, read_memory,  write_memory, tell_memory,
                                seek_memory, close_memory, error_memory, &memory};
  const Archive archive(unzOpen2_64("tilt", &functions));
  if (!archive)
    return make_error(ErrorCode::data_corrupt, "found no zip archive after the header", "file.archive");
  auto sketch = unpack(archive.get(), "data.sketch", limits);
  if (!sketch.ok()) return sketch.error();
  if (!sketch->has_value()) {
    return make_error(ErrorCode::data_corrupt, "the archive has no data.sketch", "file.archive");
  }
  Result<TiltFile> file = parse_tilt_sketch(**sketch, limits);
  if (!file.ok()) return file;
  auto metadata = unpack(archive.get(), "metadata.json", limits);
  if (!metadata.ok()) return metadata.error();
  if (metadata->has_value()) {
    file->metadata_json.assign(reinterpret_cast<const char*>((*metadata)->data()), (*metadata)->size());
  }
  return file;
}

Result<TiltFile> read_tilt_file(const std::filesystem::path& path, const TiltLimits& limits) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) {
    return make_error(ErrorCode::not_found, fmt::format("there is no file {}", path.string()), "path");
  }
  if (!std::filesystem::is_regular_file(path, error)) {
    return make_error(ErrorCode::io, fmt::format("{} is not a file", path.string()), "path");
  }
  const auto size = std::filesystem::file_size(path, error);
  if (error) {
    return make_error(ErrorCode::io, fmt::format("{}: {}", path.string(), error.message()), "path");
  }
  if (size > limits.max_file_bytes) {
    return make_error(
        ErrorCode::resource_exhausted,
        fmt::format("{} has {} bytes, the limit is {}", path.string(), size, limits.max_file_bytes), "path");
  }
  std::vector<std::byte> bytes(static_cast<std::size_t>(size));
  std::ifstream stream(path, std::ios::binary);
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!stream) return make_error(ErrorCode::io, fmt::format("{} can't be read", path.string()), "path");
  return parse_tilt(bytes, limits);
}

}  // namespace handloft::codec
