#include "server-model/exchange/reference_import.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstring>
#include <fstream>
#include <string_view>
#include <system_error>
#include <utility>

#include "server-model/exchange/input_file.h"
#include "server-model/exchange/raw_triangles.h"

namespace handloft::exchange {

namespace fs = std::filesystem;

namespace {

Status check_options(const ReferenceOptions& options) {
  const bool scale = options.scale == 0 || (std::isfinite(options.scale) && options.scale > 0);
  if (!scale) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected metres per unit above 0, or 0", options.scale),
                      "scale");
  }
  if (!options.translation.allFinite()) {
    return make_error(ErrorCode::invalid_argument, "found a number that is not finite", "translation");
  }
  constexpr std::size_t most = 1U << 28U;  // So that six times as many still are numbers of 32 bits.
  if (options.max_vertices > most || options.max_triangles > most || !(options.weld_tolerance >= 1e-9) ||
      !(options.weld_tolerance <= 1e-2) || !(options.chord_tolerance_m > 0) ||
      !(options.chord_fraction >= 1e-6)) {
    return make_error(ErrorCode::invalid_argument, "found limits or tolerances out of range", "options");
  }
  return {};
}

Result<std::vector<std::byte>> read_bounded(const fs::path& path, std::size_t most) {
  if (Status file = detail::check_input_file(path, most); !file) return file.error();
  std::ifstream stream(path, std::ios::binary | std::ios::ate);
  const auto size = stream ? static_cast<std::streamoff>(stream.tellg()) : -1;
  if (size < 0) return make_error(ErrorCode::io, "the file cannot be read", "path");
  if (static_cast<std::size_t>(size) > most) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found {} bytes, expected at most {}", size, most), "path");
  }
  std::vector<std::byte> content(static_cast<std::size_t>(size));
  stream.seekg(0);
  if (size > 0 && !stream.read(reinterpret_cast<char*>(content.data()), size)) {
    return make_error(ErrorCode::io, "the file cannot be read", "path");
  }
  return content;
}

Result<detail::RawTriangles> read_mesh(std::span<const std::byte> content, ReferenceFormat format,
                                       const ReferenceOptions& options, const FindBuffer& find_buffer) {
  switch (format) {
    case ReferenceFormat::obj:
      return detail::read_obj(content, options);
    case ReferenceFormat::stl:
      return detail::read_stl(content, options);
    case ReferenceFormat::ply:
      return detail::read_ply(content, options);
    case ReferenceFormat::gltf:
    case ReferenceFormat::glb:
      return detail::read_gltf(content, format, options, find_buffer);
    default:
      return make_error(ErrorCode::unsupported, "STEP and IGES are read from files only", "path");
  }
}

bool knows_up(ReferenceFormat format) {
  return format == ReferenceFormat::gltf || format == ReferenceFormat::glb;
}

Result<ImportedReference> placed(const detail::RawTriangles& raw, ReferenceFormat format,
                                 const ReferenceOptions& options) {
  const double metres_per_unit = options.scale > 0 ? options.scale : 1.0;
  return detail::place_in_world(raw, metres_per_unit, knows_up(format) ? UpAxis::y : options.up, options);
}

Error named(Error error, const fs::path& path) {
  if (error.field == "path") error.message = fmt::format("{}: {}", path.filename().string(), error.message);
  return error;
}

Result<ImportedReference> import_cad(const fs::path& path, ReferenceFormat format,
                                     const ReferenceOptions& options) {
  if (Status file = detail::check_input_file(path, options.max_file_bytes); !file) return file.error();
  auto raw = detail::tessellate_cad_file(path, format, options);
  if (!raw) return raw.error();
  return placed(*raw, format, options);
}

}  // namespace

Result<ReferenceFormat> reference_format(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  constexpr std::array<std::pair<std::string_view, ReferenceFormat>, 9> known{{
      {".obj", ReferenceFormat::obj},
      {".stl", ReferenceFormat::stl},
      {".ply", ReferenceFormat::ply},
      {".gltf", ReferenceFormat::gltf},
      {".glb", ReferenceFormat::glb},
      {".step", ReferenceFormat::step},
      {".stp", ReferenceFormat::step},
      {".iges", ReferenceFormat::iges},
      {".igs", ReferenceFormat::iges},
  }};
  for (const auto& [name, format] : known) {
    if (extension == name) return format;
  }
  return make_error(
      ErrorCode::unsupported,
      fmt::format("found the extension \"{}\", expected .obj, .stl, .ply, .gltf, .glb, .step, .stp, "
                  ".iges or .igs",
                  extension),
      "path");
}

Result<ImportedReference> parse_reference(std::span<const std::byte> content, ReferenceFormat format,
                                          const ReferenceOptions& options, const FindBuffer& find_buffer) {
  if (Status status = check_options(options); !status) return status.error();
  if (content.size() > options.max_file_bytes) {
    return make_error(
        ErrorCode::resource_exhausted,
        fmt::format("found {} bytes, expected at most {}", content.size(), options.max_file_bytes), "path");
  }
  auto raw = read_mesh(content, format, options, find_buffer);
  if (!raw) return raw.error();
  return placed(*raw, format, options);
}

Result<ImportedReference> import_reference(const fs::path& path, const ReferenceOptions& options) {
  if (Status status = check_options(options); !status) return status.error();
  auto format = reference_format(path);
  if (!format) return named(format.error(), path);
  if (*format == ReferenceFormat::step || *format == ReferenceFormat::iges) {
    auto imported = import_cad(path, *format, options);
    if (!imported) return named(imported.error(), path);
    return imported;
  }
  auto content = read_bounded(path, options.max_file_bytes);
  if (!content) return named(content.error(), path);
  const FindBuffer find_buffer = [&](const std::string& name,
                                     std::size_t most) -> Result<std::vector<std::byte>> {
    const fs::path buffer = path.parent_path() / name;
    std::error_code failed;
    if (fs::is_symlink(fs::symlink_status(buffer, failed))) {
      return make_error(ErrorCode::permission_denied,
                        fmt::format("found a link for the buffer {}, expected a file", name), "path");
    }
    auto bytes = read_bounded(buffer, most);
    if (!bytes) {
      Error error = bytes.error();
      error.message = fmt::format("its buffer {}: {}", name, error.message);
      return error;
    }
    return bytes;
  };
  auto imported = parse_reference(*content, *format, options, find_buffer);
  if (!imported) return named(imported.error(), path);
  return imported;
}

}  // namespace handloft::exchange
