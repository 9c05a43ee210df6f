#include "server-model/exchange/gltf_writer.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

#include "server-model/exchange/atomic_file.h"
#include "server-model/exchange/mesh_checks.h"

namespace handloft::exchange {
namespace {

using geometry::Vec3;
using Json = nlohmann::ordered_json;

static_assert(std::endian::native == std::endian::little, "glTF's byte order is written directly");

// Numbers of the glTF 2.0 specification.
constexpr std::uint32_t glb_magic = 0x46546C67;  // "glTF"
constexpr std::uint32_t glb_version = 2;
constexpr std::uint32_t json_chunk = 0x4E4F534A;    // "JSON"
constexpr std::uint32_t binary_chunk = 0x004E4942;  // "BIN\0"
constexpr int component_float = 5126;
constexpr int component_unsigned_int = 5125;
constexpr int target_array_buffer = 34962;
constexpr int target_element_array_buffer = 34963;
constexpr int mode_points = 0;
constexpr int mode_triangles = 4;

/// Collects the binary chunk, the buffer views and the accessors.
class BufferBuilder {
 public:
  /// Returns the accessor's number. `components` floats per element.
  std::size_t add_floats(const std::vector<float>& values, int components, const char* type) {
    const std::size_t view = add_view(values.data(), values.size() * sizeof(float), target_array_buffer);
    accessors_.push_back({{"bufferView", view},
                          {"componentType", component_float},
                          {"count", values.size() / static_cast<std::size_t>(components)},
                          {"type", type}});
    return accessors_.size() - 1;
  }
  /// Positions must carry their bounds.
  std::size_t add_positions(const std::vector<float>& values) {
    std::array<float, 3> lower;
    std::array<float, 3> upper;
    lower.fill(std::numeric_limits<float>::max());
    upper.fill(std::numeric_limits<float>::lowest());
    for (std::size_t i = 0; i < values.size(); ++i) {
      lower[i % 3] = std::min(lower[i % 3], values[i]);
      upper[i % 3] = std::max(upper[i % 3], values[i]);
    }
    const std::size_t accessor = add_floats(values, 3, "VEC3");
    accessors_[accessor]["min"] = lower;
    accessors_[accessor]["max"] = upper;
    return accessor;
  }
  std::size_t add_indices(const std::vector<std::uint32_t>& indices) {
    const std::size_t view =
        add_view(indices.data(), indices.size() * sizeof(std::uint32_t), target_element_array_buffer);
    accessors_.push_back({{"bufferView", view},
                          {"componentType", component_unsigned_int},
                          {"count", indices.size()},
                          {"type", "SCALAR"}});
    return accessors_.size() - 1;
  }

  std::vector<std::byte> take_bytes() { return std::move(bytes_); }
  Json take_views() { return std::move(views_); }
  Json take_accessors() { return std::move(accessors_); }

 private:
  std::size_t add_view(const void* data, std::size_t size, int target) {
    // All elements are multiples of four bytes: views stay aligned.
    const std::size_t offset = bytes_.size();
    bytes_.resize(offset + size);
    std::memcpy(bytes_.data() + offset, data, size);
    views_.push_back({{"buffer", 0}, {"byteOffset", offset}, {"byteLength", size}, {"target", target}});
    return views_.size() - 1;
  }

  std::vector<std::byte> bytes_;
  Json views_ = Json::array();
  Json accessors_ = Json::array();
};

Vec3 middle_of(const Vec3& lower, const Vec3& upper) {
  return 0.5 * lower + 0.5 * upper;
}

void push(std::vector<float>& out, const Vec3& v) {
  for (int k = 0; k < 3; ++k) out.push_back(static_cast<float>(v[k]));
}

struct Primitive {
  Json json;
  Vec3 centre;
};

Primitive add_mesh(const MeshExport& item, BufferBuilder& buffer) {
  const geometry::TriangleMesh& mesh = item.mesh;
  Vec3 lower = mesh.positions.front();
  Vec3 upper = lower;
  for (const Vec3& p : mesh.positions) {
    lower = lower.cwiseMin(p);
    upper = upper.cwiseMax(p);
  }
  const Vec3 centre = middle_of(lower, upper);
  std::vector<float> positions;
  std::vector<float> normals;
  std::vector<float> colors;
  positions.reserve(3 * mesh.vertex_count());
  normals.reserve(3 * mesh.vertex_count());
  colors.reserve(4 * mesh.vertex_count());
  for (std::size_t i = 0; i < mesh.vertex_count(); ++i) {
    push(positions, mesh.positions[i] - centre);
    push(normals, mesh.normals[i].normalized());
    for (const float channel : {item.red, item.green, item.blue}) colors.push_back(channel);
    colors.push_back(static_cast<float>(mesh.opacity[i]));
  }
  Json attributes{{"POSITION", buffer.add_positions(positions)},
                  {"NORMAL", buffer.add_floats(normals, 3, "VEC3")},
                  {"COLOR_0", buffer.add_floats(colors, 4, "VEC4")}};
  return {Json{{"attributes", std::move(attributes)},
               {"indices", buffer.add_indices(mesh.indices)},
               {"material", 0},
               {"mode", mode_triangles}},
          centre};
}

Primitive add_cloud(const PointCloudExport& cloud, BufferBuilder& buffer) {
  Vec3 lower = cloud.points.front().position;
  Vec3 upper = lower;
  for (const geometry::WeightedPoint& p : cloud.points) {
    lower = lower.cwiseMin(p.position);
    upper = upper.cwiseMax(p.position);
  }
  const Vec3 centre = middle_of(lower, upper);
  std::vector<float> positions;
  std::vector<float> colors;
  for (const geometry::WeightedPoint& p : cloud.points) {
    push(positions, p.position - centre);
    for (const float channel : {cloud.red, cloud.green, cloud.blue}) colors.push_back(channel);
    colors.push_back(static_cast<float>(p.weight));
  }
  Json attributes{{"POSITION", buffer.add_positions(positions)},
                  {"COLOR_0", buffer.add_floats(colors, 4, "VEC4")}};
  return {Json{{"attributes", std::move(attributes)}, {"material", 0}, {"mode", mode_points}}, centre};
}

void append(std::vector<std::byte>& out, std::uint32_t value) {
  const auto bytes = std::as_bytes(std::span(&value, 1));
  out.insert(out.end(), bytes.begin(), bytes.end());
}

std::vector<std::byte> pack(std::string text, std::vector<std::byte> binary) {
  text.resize((text.size() + 3) / 4 * 4, ' ');
  binary.resize((binary.size() + 3) / 4 * 4, std::byte{0});
  constexpr std::size_t headers = 12 + 8 + 8;
  const std::size_t total = headers + text.size() + binary.size();
  std::vector<std::byte> out;
  out.reserve(total);
  append(out, glb_magic);
  append(out, glb_version);
  append(out, static_cast<std::uint32_t>(total));
  append(out, static_cast<std::uint32_t>(text.size()));
  append(out, json_chunk);
  const auto text_bytes = std::as_bytes(std::span(text));
  out.insert(out.end(), text_bytes.begin(), text_bytes.end());
  append(out, static_cast<std::uint32_t>(binary.size()));
  append(out, binary_chunk);
  out.insert(out.end(), binary.begin(), binary.end());
  return out;
}

}  // namespace

Result<std::vector<std::byte>> to_glb(std::span<const MeshExport> meshes,
                                      std::span<const PointCloudExport> clouds) {
  if (Status status = detail::check_meshes(meshes); !status.ok()) return status.error();
  if (Status status = detail::check_clouds(clouds); !status.ok()) return status.error();
  if (meshes.empty() && clouds.empty()) {
    return make_error(ErrorCode::invalid_argument, "found nothing to export, expected a mesh or points",
                      "meshes");
  }
  BufferBuilder buffer;
  Json nodes = Json::array();
  Json mesh_list = Json::array();
  Json children = Json::array();
  // Node 0 turns +Z up into +Y up: a quarter turn about -x, as quaternion (x, y, z, w).
  const double half = std::sqrt(0.5);
  nodes.push_back({{"name", "handloft"}, {"rotation", {-half, 0.0, 0.0, half}}});
  const auto add_node = [&](const std::string& name, Primitive primitive) {
    children.push_back(nodes.size());
    nodes.push_back({{"name", name},
                     {"mesh", mesh_list.size()},
                     {"translation", {primitive.centre.x(), primitive.centre.y(), primitive.centre.z()}}});
    mesh_list.push_back({{"name", name}, {"primitives", Json::array({std::move(primitive.json)})}});
  };
  for (const MeshExport& mesh : meshes) add_node(mesh.name, add_mesh(mesh, buffer));
  for (const PointCloudExport& cloud : clouds) add_node(cloud.name, add_cloud(cloud, buffer));
  nodes[0]["children"] = std::move(children);

  std::vector<std::byte> binary = buffer.take_bytes();
  if (binary.size() > std::numeric_limits<std::uint32_t>::max() / 2) {
    return make_error(ErrorCode::resource_exhausted, "the meshes are too large for a .glb file", "meshes");
  }
  const Json material{
      {"name", "surface"},
      {"pbrMetallicRoughness",
       {{"baseColorFactor", {1.0, 1.0, 1.0, 1.0}}, {"metallicFactor", 0.0}, {"roughnessFactor", 0.5}}},
      {"alphaMode", "BLEND"},
      {"doubleSided", true}};
  const Json document{{"asset", {{"version", "2.0"}, {"generator", "Handloft"}}},
                      {"scene", 0},
                      {"scenes", Json::array({Json{{"nodes", {0}}}})},
                      {"nodes", std::move(nodes)},
                      {"meshes", std::move(mesh_list)},
                      {"materials", Json::array({material})},
                      {"accessors", buffer.take_accessors()},
                      {"bufferViews", buffer.take_views()},
                      {"buffers", Json::array({Json{{"byteLength", binary.size()}}})}};
  // Names that are not UTF-8 get replacement characters instead of an exception.
  std::string text = document.dump(-1, ' ', false, Json::error_handler_t::replace);
  return pack(std::move(text), std::move(binary));
}

Status write_glb(const std::filesystem::path& path, std::span<const MeshExport> meshes,
                 std::span<const PointCloudExport> clouds) {
  const Result<std::vector<std::byte>> bytes = to_glb(meshes, clouds);
  if (!bytes.ok()) return bytes.error();
  return write_file_atomically(path, std::span<const std::byte>(*bytes));
}

}  // namespace handloft::exchange
