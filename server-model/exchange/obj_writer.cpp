#include "server-model/exchange/obj_writer.h"

#include <array>
#include <charconv>
#include <cstdint>

#include "server-model/exchange/atomic_file.h"
#include "server-model/exchange/mesh_checks.h"

namespace handloft::exchange {
namespace {

/// Shortest text that reads back to the same bits; std::to_chars knows no locale.
void append_number(std::string& out, double value) {
  std::array<char, 32> buffer;
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr;
  out.append(buffer.data(), end);
}

void append_vector(std::string& out, const char* keyword, const geometry::Vec3& v) {
  out += keyword;
  for (int k = 0; k < 3; ++k) {
    out += ' ';
    append_number(out, v[k]);
  }
  out += '\n';
}

/// OBJ ends a name at white space or the line's end.
std::string object_name(const std::string& name) {
  std::string safe = name.empty() ? "surface" : name;
  for (char& c : safe) {
    if (static_cast<unsigned char>(c) <= ' ' || c == '\x7f') c = '_';
  }
  return safe;
}

}  // namespace

Result<std::string> to_obj(std::span<const MeshExport> meshes) {
  if (Status status = detail::check_meshes(meshes); !status.ok()) return status.error();
  if (meshes.empty()) {
    return make_error(ErrorCode::invalid_argument, "found nothing to export, expected a mesh", "meshes");
  }
  std::string out = "# Handloft, metres, +Z up\n";
  std::size_t first = 1;  // OBJ counts from 1, over all objects.
  for (const MeshExport& item : meshes) {
    out += "o " + object_name(item.name) + '\n';
    for (const geometry::Vec3& p : item.mesh.positions) append_vector(out, "v", p);
    for (const geometry::Vec3& n : item.mesh.normals) append_vector(out, "vn", n);
    for (std::size_t i = 0; i < item.mesh.indices.size(); ++i) {
      const std::string index = std::to_string(first + item.mesh.indices[i]);
      out += i % 3 == 0 ? "f " : " ";
      out.append(index).append("//").append(index);
      if (i % 3 == 2) out += '\n';
    }
    first += item.mesh.vertex_count();
  }
  return out;
}

Status write_obj(const std::filesystem::path& path, std::span<const MeshExport> meshes) {
  const Result<std::string> text = to_obj(meshes);
  if (!text.ok()) return text.error();
  return write_file_atomically(path, std::string_view(*text));
}

}  // namespace handloft::exchange
