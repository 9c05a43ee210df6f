// The triangles of a glTF 2.0 or GLB file's scene, with every range checked before it is used (glTF 2.0
// specification, sections 3.6 and 4).

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>

#include "server-model/exchange/raw_triangles.h"
#include "server-model/exchange/reference_text.h"

namespace handloft::exchange::detail {
namespace {

using nlohmann::json;

constexpr std::size_t max_json_bytes = 16U << 20U;  ///< Parsed, it takes some ten times as much.
constexpr int max_json_depth = 32;                  ///< glTF needs six.
constexpr std::size_t max_node_depth = 256;         ///< More than any exporter nests.
constexpr std::size_t max_objects = 65536;          ///< Nodes, meshes, accessors: each.

/// Thrown inside of this file only.
struct Refusal {
  Error error;
};

[[noreturn]] void refuse(ErrorCode code, std::string message) {
  throw Refusal{make_error(code, std::move(message), "path")};
}
[[noreturn]] void corrupt(std::string message) {
  refuse(ErrorCode::data_corrupt, std::move(message));
}

struct Container {
  std::string_view text;
  std::optional<std::span<const std::byte>> binary;  ///< The BIN chunk of a GLB.
};

std::uint32_t read_u32(std::span<const std::byte> content, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t k = 0; k < 4; ++k) value |= std::to_integer<std::uint32_t>(content[at + k]) << (8U * k);
  return value;
}

Container open_glb(std::span<const std::byte> content) {
  constexpr std::size_t header = 12;
  constexpr std::size_t chunk_header = 8;
  constexpr std::uint32_t magic = 0x46546C67;
  constexpr std::uint32_t json_chunk = 0x4E4F534A;
  constexpr std::uint32_t binary_chunk = 0x004E4942;
  if (content.size() < header + chunk_header || read_u32(content, 0) != magic) {
    corrupt("found no GLB header, expected a binary glTF file");
  }
  if (read_u32(content, 4) != 2) {
    refuse(ErrorCode::unsupported, fmt::format("found GLB version {}, expected 2", read_u32(content, 4)));
  }
  const std::size_t length = read_u32(content, 8);
  if (length > content.size()) {
    corrupt(fmt::format("the file is cut off: {} bytes of {}", content.size(), length));
  }
  content = content.first(std::max(length, header));
  Container container;
  std::size_t at = header;
  for (int chunk = 0; at + chunk_header <= content.size(); ++chunk) {
    const std::size_t size = read_u32(content, at);
    const std::uint32_t type = read_u32(content, at + 4);
    at += chunk_header;
    if (size > content.size() - at) corrupt(fmt::format("chunk {} is longer than the file", chunk));
    const std::span<const std::byte> data = content.subspan(at, size);
    if (chunk == 0 && type != json_chunk) corrupt("the first chunk is not JSON");
    if (chunk == 0) container.text = as_text(data);
    if (chunk == 1 && type == binary_chunk) container.binary = data;
    at += size;
  }
  return container;
}

json parse(std::string_view text) {
  if (text.size() > max_json_bytes) {
    refuse(ErrorCode::resource_exhausted,
           fmt::format("the JSON is {} bytes long, expected at most {}", text.size(), max_json_bytes));
  }
  bool too_deep = false;
  const json document = json::parse(
      text,
      [&](int depth, json::parse_event_t, json&) {
        too_deep = too_deep || depth > max_json_depth;
        return !too_deep;
      },
      false);
  if (too_deep || document.is_discarded() || !document.is_object()) {
    corrupt("found no JSON object, expected a glTF file");
  }
  return document;
}

const json& list(const json& document, const char* name) {
  static const json none = json::array();
  const auto found = document.find(name);
  if (found == document.end()) return none;
  if (!found->is_array() || found->size() > max_objects) {
    corrupt(fmt::format("\"{}\" is not a list of at most {}", name, max_objects));
  }
  return *found;
}

/// A whole number from 0 to `most`.
std::uint64_t number(const json& object, const char* name, std::uint64_t most,
                     std::optional<std::uint64_t> otherwise = {}) {
  if (!object.is_object())
    corrupt(fmt::format("found something that is no object where \"{}\" stands", name));
  const auto found = object.find(name);
  if (found == object.end()) {
    if (otherwise) return *otherwise;
    corrupt(fmt::format("\"{}\" is missing", name));
  }
  if (!found->is_number_unsigned() || found->get<std::uint64_t>() > most) {
    corrupt(fmt::format("\"{}\" is not a number from 0 to {}", name, most));
  }
  return found->get<std::uint64_t>();
}

std::uint64_t index(const json& object, const char* name, const json& of) {
  if (of.empty()) corrupt(fmt::format("\"{}\" names one of nothing", name));
  return number(object, name, of.size() - 1);
}

std::vector<std::byte> decode_data_uri(std::string_view uri) {
  constexpr std::string_view marker = ";base64,";
  const std::size_t at = uri.find(marker);
  if (at == std::string_view::npos) refuse(ErrorCode::unsupported, "found a data URI that is not base64");
  uri.remove_prefix(at + marker.size());
  std::vector<std::byte> bytes;
  bytes.reserve(uri.size() / 4 * 3);
  std::uint32_t bits = 0;
  unsigned have = 0;
  for (const char c : uri) {
    std::uint32_t value = 0;
    if (c >= 'A' && c <= 'Z') {
      value = static_cast<std::uint32_t>(c - 'A');
    } else if (c >= 'a' && c <= 'z') {
      value = static_cast<std::uint32_t>(c - 'a') + 26U;
    } else if (c >= '0' && c <= '9') {
      value = static_cast<std::uint32_t>(c - '0') + 52U;
    } else if (c == '+' || c == '/') {
      value = c == '+' ? 62U : 63U;
    } else if (c == '=') {
      break;
    } else {
      corrupt("found a character that is not base64 in a data URI");
    }
    bits = (bits << 6U) | value;
    have += 6;
    if (have >= 8) {
      have -= 8;
      bytes.push_back(static_cast<std::byte>((bits >> have) & 0xffU));
    }
  }
  return bytes;
}

class SceneReader {
 public:
  SceneReader(const json& source, const ReferenceOptions& options) : source_(source), options_(options) {}

  RawTriangles read(const std::optional<std::span<const std::byte>>& binary, const FindBuffer& find_buffer) {
    check_asset();
    read_buffers(binary, find_buffer);
    read_views();
    place_nodes();
    return std::move(result_);
  }

 private:
  struct View {
    std::span<const std::byte> bytes;
    std::uint64_t stride = 0;  ///< 0: elements follow one another.
  };
  struct Accessor {
    std::span<const std::byte> bytes;
    std::uint64_t count = 0;
    std::uint64_t stride = 0;
    std::uint64_t component_size = 0;

    std::uint32_t integer(std::uint64_t element, std::uint64_t offset = 0) const {
      std::uint32_t value = 0;
      for (std::uint64_t k = 0; k < component_size; ++k) {
        value |= std::to_integer<std::uint32_t>(bytes[element * stride + offset + k]) << (8U * k);
      }
      return value;
    }
  };

  void check_asset() const {
    const auto asset = source_.find("asset");
    const auto version =
        asset == source_.end() || !asset->is_object() ? json() : asset->value("version", json());
    if (!version.is_string() || version.get<std::string>().substr(0, 2) != "2.") {
      refuse(ErrorCode::unsupported, "found no \"asset\" of version 2, expected glTF 2.0");
    }
    for (const json& extension : list(source_, "extensionsRequired")) {
      if (!extension.is_string()) corrupt("\"extensionsRequired\" holds something that is not a name");
      const auto name = extension.get<std::string>();
      // Looks only; geometry is all that we take.
      if (name.rfind("KHR_materials", 0) == 0 || name.rfind("KHR_texture", 0) == 0 ||
          name.rfind("KHR_lights", 0) == 0) {
        continue;
      }
      refuse(ErrorCode::unsupported,
             "found a required extension, expected plain glTF; please export without "
             "compression or quantisation");
    }
  }

  void read_buffers(const std::optional<std::span<const std::byte>>& binary, const FindBuffer& find_buffer) {
    std::size_t left = options_.max_file_bytes;
    for (const json& buffer : list(source_, "buffers")) {
      const std::uint64_t length = number(buffer, "byteLength", options_.max_file_bytes);
      std::vector<std::byte> bytes;
      const auto uri = buffer.find("uri");
      if (uri == buffer.end()) {
        if (!binary || !buffers_.empty()) corrupt("found a buffer without content");
        bytes.assign(binary->begin(), binary->end());
      } else if (!uri->is_string()) {
        corrupt("a buffer's \"uri\" is not text");
      } else if (const auto text = uri->get<std::string>(); text.rfind("data:", 0) == 0) {
        bytes = decode_data_uri(text);
      } else {
        bytes = beside(text, left, find_buffer);
      }
      if (bytes.size() < length) {
        corrupt(fmt::format("a buffer holds {} bytes, expected {}", bytes.size(), length));
      }
      bytes.resize(length);
      if (length > left) {
        refuse(ErrorCode::resource_exhausted,
               fmt::format("the buffers hold more than {} bytes", options_.max_file_bytes));
      }
      left -= length;
      buffers_.push_back(std::move(bytes));
    }
  }

  static std::vector<std::byte> beside(const std::string& name, std::size_t most,
                                       const FindBuffer& find_buffer) {
    const bool plain = !name.empty() && name.size() <= 255 && name[0] != '.' &&
                       std::all_of(name.begin(), name.end(), [](unsigned char c) {
                         return c >= ' ' && c != '/' && c != '\\' && c != ':' && c != '%' && c != 0x7f;
                       });
    if (!plain || !find_buffer) {
      refuse(ErrorCode::permission_denied,
             "found a buffer in another place, expected the plain name of a file beside this one");
    }
    Result<std::vector<std::byte>> found = find_buffer(name, most);
    if (!found) throw Refusal{found.error()};
    return std::move(*found);
  }

  void read_views() {
    const json& buffers = list(source_, "buffers");
    for (const json& view : list(source_, "bufferViews")) {
      const std::span<const std::byte> buffer = buffers_[index(view, "buffer", buffers)];
      const std::uint64_t offset = number(view, "byteOffset", buffer.size(), 0);
      const std::uint64_t length = number(view, "byteLength", buffer.size() - offset);
      constexpr std::uint64_t longest_stride = 252;
      views_.push_back({buffer.subspan(offset, length), number(view, "byteStride", longest_stride, 0)});
    }
  }

  Accessor accessor(const json& parent, const char* name, bool positions) const {
    const json& accessors = list(source_, "accessors");
    const json& from = accessors[index(parent, name, accessors)];
    if (!from.is_object()) corrupt("an accessor is not an object");
    if (from.contains("sparse"))
      refuse(ErrorCode::unsupported, "found a sparse accessor, expected a plain one");
    constexpr std::uint64_t byte_type = 5121;
    constexpr std::uint64_t short_type = 5123;
    constexpr std::uint64_t int_type = 5125;
    constexpr std::uint64_t float_type = 5126;
    const std::uint64_t component = number(from, "componentType", float_type);
    const auto type = from.find("type");
    const bool is_whole = component == byte_type || component == short_type || component == int_type;
    if (type == from.end() ||
        !(positions ? component == float_type && *type == "VEC3" : is_whole && *type == "SCALAR")) {
      corrupt(positions ? "found positions that are not three floats"
                        : "found indices that are not whole numbers");
    }
    Accessor result;
    result.component_size = component == byte_type ? 1U : (component == short_type ? 2U : 4U);
    const std::uint64_t element = positions ? 3 * result.component_size : result.component_size;
    result.count = number(from, "count", positions ? max_raw_vertices(options_) : 3 * options_.max_triangles);
    if (views_.empty()) corrupt("an accessor has no buffer view");
    const View& view = views_[number(from, "bufferView", views_.size() - 1)];
    result.bytes = view.bytes.subspan(number(from, "byteOffset", view.bytes.size(), 0));
    result.stride = view.stride != 0 ? view.stride : element;
    if (result.count == 0 || result.stride < element || result.bytes.size() < element ||
        (result.bytes.size() - element) / result.stride < result.count - 1) {
      corrupt(fmt::format("an accessor of {} elements does not fit into its buffer", result.count));
    }
    return result;
  }

  void append_primitive(const json& primitive, const Eigen::Affine3d& world_from_mesh) {
    constexpr std::uint64_t triangles = 4;
    constexpr std::uint64_t strip = 5;
    constexpr std::uint64_t fan = 6;
    const std::uint64_t mode = number(primitive, "mode", fan, triangles);
    if (mode < triangles) return;  // Points and lines.
    const auto attributes = primitive.find("attributes");
    if (attributes == primitive.end() || !attributes->is_object()) corrupt("a primitive has no attributes");
    if (!attributes->contains("POSITION")) return;  // Allowed, and nothing to see.
    const Accessor positions = accessor(*attributes, "POSITION", true);
    std::vector<std::uint32_t> corners;
    if (primitive.contains("indices")) {
      const Accessor indices = accessor(primitive, "indices", false);
      for (std::uint64_t i = 0; i < indices.count; ++i) {
        corners.push_back(indices.integer(i));
        if (corners.back() >= positions.count) {
          corrupt(
              fmt::format("index {} names vertex {}, expected below {}", i, corners.back(), positions.count));
        }
      }
    } else {
      for (std::uint32_t i = 0; i < positions.count; ++i) corners.push_back(i);
    }
    if (Status status = check_counts(result_.positions.size() + positions.count,
                                     (result_.indices.size() + corners.size()) / 3, options_);
        !status) {
      throw Refusal{status.error()};
    }
    const auto base = static_cast<std::uint32_t>(result_.positions.size());
    for (std::uint64_t i = 0; i < positions.count; ++i) {
      geometry::Vec3 p;
      for (int axis = 0; axis < 3; ++axis) {
        p[axis] = static_cast<double>(std::bit_cast<float>(
            positions.integer(i, positions.component_size * static_cast<std::uint64_t>(axis))));
      }
      result_.positions.push_back(world_from_mesh * p);
    }
    const bool turned_over = world_from_mesh.linear().determinant() < 0;
    const auto triangle = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
      if (turned_over) std::swap(b, c);
      for (const std::uint32_t corner : {a, b, c}) result_.indices.push_back(base + corner);
    };
    if (mode == triangles) {
      for (std::size_t i = 0; i + 2 < corners.size(); i += 3)
        triangle(corners[i], corners[i + 1], corners[i + 2]);
    }
    for (std::size_t i = 0; mode == strip && i + 2 < corners.size(); ++i) {
      triangle(corners[i], corners[i + 1 + i % 2], corners[i + 2 - i % 2]);
    }
    for (std::size_t i = 1; mode == fan && i + 1 < corners.size(); ++i) {
      triangle(corners[0], corners[i], corners[i + 1]);
    }
    if (Status status = check_counts(0, result_.indices.size() / 3, options_); !status)
      throw Refusal{status.error()};
  }

  template <std::size_t count>
  static std::array<double, count> numbers(const json& node, const char* name,
                                           const std::array<double, count>& otherwise) {
    const auto found = node.find(name);
    if (found == node.end()) return otherwise;
    if (!found->is_array() || found->size() != count)
      corrupt(fmt::format("a node's \"{}\" is not {} numbers", name, count));
    std::array<double, count> values{};
    for (std::size_t i = 0; i < count; ++i) {
      if (!(*found)[i].is_number()) corrupt(fmt::format("a node's \"{}\" is not {} numbers", name, count));
      values[i] = (*found)[i].template get<double>();
    }
    return values;
  }

  static Eigen::Affine3d parent_from_node(const json& node) {
    Eigen::Affine3d result = Eigen::Affine3d::Identity();
    if (node.contains("matrix")) {
      const auto m = numbers<16>(node, "matrix", {});
      result.matrix() = Eigen::Map<const Eigen::Matrix4d>(m.data());
      result.makeAffine();
      return result;
    }
    const auto t = numbers<3>(node, "translation", {0, 0, 0});
    const auto r = numbers<4>(node, "rotation", {0, 0, 0, 1});
    const auto s = numbers<3>(node, "scale", {1, 1, 1});
    const Eigen::Quaterniond rotation(r[3], r[0], r[1], r[2]);
    if (!(rotation.norm() > 0)) corrupt("a node's \"rotation\" is no quaternion");
    result.translate(geometry::Vec3(t[0], t[1], t[2]));
    result.rotate(rotation.normalized());
    result.scale(geometry::Vec3(s[0], s[1], s[2]));
    return result;
  }

  void place_nodes() {
    const json& nodes = list(source_, "nodes");
    const json& meshes = list(source_, "meshes");
    const std::vector<bool> has_parent = parents(nodes);
    struct Open {
      std::uint64_t node;
      std::size_t depth;
      Eigen::Affine3d world_from_parent;
    };
    // Every node has one parent at most and roots have none, so going down ends.
    std::vector<Open> open;
    for (const std::uint64_t root : roots(nodes, has_parent))
      open.push_back({root, 1, Eigen::Affine3d::Identity()});
    while (!open.empty()) {
      const Open at = open.back();
      open.pop_back();
      if (at.depth > max_node_depth) corrupt(fmt::format("the nodes stand deeper than {}", max_node_depth));
      const json& node = nodes[at.node];
      const Eigen::Affine3d world_from_node = at.world_from_parent * parent_from_node(node);
      if (node.contains("mesh")) {
        const json& mesh = meshes[index(node, "mesh", meshes)];
        if (!mesh.is_object()) corrupt("a mesh is not an object");
        for (const json& primitive : list(mesh, "primitives")) append_primitive(primitive, world_from_node);
      }
      for (const json& child : list(node, "children")) {
        open.push_back({child.get<std::uint64_t>(), at.depth + 1, world_from_node});
      }
    }
  }

  static std::vector<bool> parents(const json& nodes) {
    std::vector<bool> has_parent(nodes.size(), false);
    for (const json& node : nodes) {
      if (!node.is_object()) corrupt("a node is not an object");
      for (const json& child : list(node, "children")) {
        if (!child.is_number_unsigned() || child.get<std::uint64_t>() >= nodes.size() ||
            has_parent[child.get<std::uint64_t>()]) {
          corrupt("the nodes are no tree");
        }
        has_parent[child.get<std::uint64_t>()] = true;
      }
    }
    return has_parent;
  }

  std::vector<std::uint64_t> roots(const json& nodes, const std::vector<bool>& has_parent) const {
    std::vector<std::uint64_t> result;
    const json& scenes = list(source_, "scenes");
    if (scenes.empty()) {
      for (std::uint64_t i = 0; i < nodes.size(); ++i) {
        if (!has_parent[i]) result.push_back(i);
      }
      return result;
    }
    const json& scene = scenes[number(source_, "scene", scenes.size() - 1, 0)];
    if (!scene.is_object()) corrupt("a scene is not an object");
    std::vector<bool> named(nodes.size(), false);
    for (const json& root : list(scene, "nodes")) {
      if (!root.is_number_unsigned() || root.get<std::uint64_t>() >= nodes.size() ||
          has_parent[root.get<std::uint64_t>()] || named[root.get<std::uint64_t>()]) {
        corrupt("a scene names a node that is no root");
      }
      named[root.get<std::uint64_t>()] = true;
      result.push_back(root.get<std::uint64_t>());
    }
    return result;
  }

  const json& source_;
  const ReferenceOptions& options_;
  std::vector<std::vector<std::byte>> buffers_;
  std::vector<View> views_;
  RawTriangles result_;
};

}  // namespace

Result<RawTriangles> read_gltf(std::span<const std::byte> content, ReferenceFormat format,
                               const ReferenceOptions& options, const FindBuffer& find_buffer) {
  try {
    const Container container =
        format == ReferenceFormat::glb ? open_glb(content) : Container{as_text(content), std::nullopt};
    const json source = parse(container.text);
    return SceneReader(source, options).read(container.binary, find_buffer);
  } catch (const Refusal& refusal) {
    return refusal.error;
  } catch (const std::bad_alloc&) {
    return make_error(ErrorCode::resource_exhausted, "reading the glTF ran out of memory", "path");
  } catch (const std::exception& exception) {
    return make_error(ErrorCode::data_corrupt, fmt::format("reading the glTF failed: {}", exception.what()),
                      "path");
  }
}

}  // namespace handloft::exchange::detail
