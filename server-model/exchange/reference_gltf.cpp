// A glTF 2.0 or GLB file reduced to the geometry of its scene, with every range checked (glTF 2.0
// specification, sections 3.6 and 4): what goes on to Assimp is a small file of known shape.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>

#include "server-model/exchange/raw_triangles.h"

namespace handloft::exchange::detail {
namespace {

using nlohmann::json;

constexpr std::size_t max_json_bytes = 16U << 20U;  ///< Parsed, it takes some ten times as much.
constexpr int max_json_depth = 32;                  ///< glTF needs six.
constexpr std::size_t max_node_depth = 256;         ///< Assimp goes down recursively.
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

std::string_view as_text(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
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

class Reducer {
 public:
  Reducer(const json& source, const ReferenceOptions& options) : source_(source), options_(options) {}

  FilesInMemory reduce(const std::optional<std::span<const std::byte>>& binary,
                       const FindBuffer& find_buffer) {
    check_asset();
    copy_buffers(binary, find_buffer);
    copy_views();
    copy_accessors();
    copy_meshes();
    copy_nodes();
    result_["asset"] = {{"version", "2.0"}};
    const std::string text = result_.dump();
    const auto bytes = std::as_bytes(std::span(text));
    files_["main.gltf"].assign(bytes.begin(), bytes.end());
    return std::move(files_);
  }

 private:
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

  void copy_buffers(const std::optional<std::span<const std::byte>>& binary, const FindBuffer& find_buffer) {
    std::size_t left = options_.max_file_bytes;
    result_["buffers"] = json::array();
    for (const json& buffer : list(source_, "buffers")) {
      const std::uint64_t length = number(buffer, "byteLength", options_.max_file_bytes);
      const std::string name = fmt::format("buffer{}.bin", result_["buffers"].size());
      std::vector<std::byte>& bytes = files_[name];
      const auto uri = buffer.find("uri");
      if (uri == buffer.end()) {
        if (!binary || !result_["buffers"].empty()) corrupt("found a buffer without content");
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
      result_["buffers"].push_back({{"byteLength", length}, {"uri", name}});
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

  void copy_views() {
    result_["bufferViews"] = json::array();
    const json& buffers = list(source_, "buffers");
    for (const json& view : list(source_, "bufferViews")) {
      const std::uint64_t buffer = index(view, "buffer", buffers);
      const std::uint64_t size = result_["buffers"][buffer]["byteLength"].get<std::uint64_t>();
      const std::uint64_t offset = number(view, "byteOffset", size, 0);
      const std::uint64_t length = number(view, "byteLength", size - offset);
      json copy = {{"buffer", buffer}, {"byteOffset", offset}, {"byteLength", length}};
      constexpr std::uint64_t longest_stride = 252;
      if (view.contains("byteStride")) copy["byteStride"] = number(view, "byteStride", longest_stride);
      result_["bufferViews"].push_back(std::move(copy));
    }
  }

  void copy_accessors() {
    // Those of geometry are checked and copied when a mesh names them.
    const json& accessors = list(source_, "accessors");
    result_["accessors"] = json::array();
    copied_.assign(accessors.size(), std::nullopt);
  }

  std::uint64_t copy_accessor(const json& parent, const char* name, bool positions) {
    const json& accessors = list(source_, "accessors");
    const std::uint64_t which = index(parent, name, accessors);
    const json& from = accessors[which];
    if (!from.is_object()) corrupt("an accessor is not an object");
    if (from.contains("sparse"))
      refuse(ErrorCode::unsupported, "found a sparse accessor, expected a plain one");
    constexpr std::uint64_t byte_type = 5121;
    constexpr std::uint64_t short_type = 5123;
    constexpr std::uint64_t int_type = 5125;
    constexpr std::uint64_t float_type = 5126;
    const std::uint64_t component = number(from, "componentType", float_type);
    const std::string type = from.value("type", json()).is_string() ? from["type"].get<std::string>() : "";
    const bool good = positions
                          ? component == float_type && type == "VEC3"
                          : (component == byte_type || component == short_type || component == int_type) &&
                                type == "SCALAR";
    if (!good) {
      corrupt(positions ? "found positions that are not three floats"
                        : "found indices that are not whole numbers");
    }
    const std::uint64_t element =
        positions ? 12U : (component == byte_type ? 1U : (component == short_type ? 2U : 4U));
    const std::uint64_t count =
        number(from, "count", positions ? max_raw_vertices(options_) : 3 * options_.max_triangles);
    if (count == 0) corrupt("found an accessor of nothing");
    const std::uint64_t view = index(from, "bufferView", result_["bufferViews"]);
    const json& range = result_["bufferViews"][view];
    const std::uint64_t length = range["byteLength"].get<std::uint64_t>();
    const std::uint64_t offset = number(from, "byteOffset", length, 0);
    const std::uint64_t stride = range.value("byteStride", element);
    if (stride < element || offset + stride * (count - 1) + element > length) {
      corrupt(fmt::format("an accessor of {} elements does not fit into its buffer", count));
    }
    if (!positions) check_range(range, offset, stride, element, count, parent);
    if (!copied_[which]) {
      copied_[which] = result_["accessors"].size();
      result_["accessors"].push_back({{"bufferView", view},
                                      {"byteOffset", offset},
                                      {"componentType", component},
                                      {"count", count},
                                      {"type", type}});
    }
    return *copied_[which];
  }

  /// Indices lead to positions of the same primitive.
  void check_range(const json& view, std::uint64_t offset, std::uint64_t stride, std::uint64_t element,
                   std::uint64_t count, const json& primitive) const {
    const json& positions =
        list(source_, "accessors")[index(primitive["attributes"], "POSITION", list(source_, "accessors"))];
    const std::uint64_t vertices = number(positions, "count", max_raw_vertices(options_));
    const auto bytes = std::span(files_.at(fmt::format("buffer{}.bin", view["buffer"].get<std::uint64_t>())))
                           .subspan(view["byteOffset"].get<std::uint64_t>() + offset);
    for (std::uint64_t i = 0; i < count; ++i) {
      std::uint32_t value = 0;
      for (std::uint64_t k = 0; k < element; ++k) {
        value |= std::to_integer<std::uint32_t>(bytes[i * stride + k]) << (8U * k);
      }
      if (value >= vertices) {
        corrupt(fmt::format("index {} names vertex {}, expected below {}", i, value, vertices));
      }
    }
  }

  void copy_meshes() {
    result_["meshes"] = json::array();
    constexpr std::uint64_t triangles = 4;
    constexpr std::uint64_t fan = 6;
    for (const json& mesh : list(source_, "meshes")) {
      if (!mesh.is_object()) corrupt("a mesh is not an object");
      json primitives = json::array();
      for (const json& primitive : list(mesh, "primitives")) {
        const std::uint64_t mode = number(primitive, "mode", fan, triangles);
        if (mode < triangles) continue;  // Points and lines.
        const auto attributes = primitive.find("attributes");
        if (attributes == primitive.end() || !attributes->is_object())
          corrupt("a primitive has no attributes");
        if (!attributes->contains("POSITION")) continue;  // Allowed, and nothing to see.
        json copy = {{"mode", mode},
                     {"attributes", {{"POSITION", copy_accessor(*attributes, "POSITION", true)}}}};
        if (primitive.contains("indices")) copy["indices"] = copy_accessor(primitive, "indices", false);
        primitives.push_back(std::move(copy));
      }
      result_["meshes"].push_back({{"primitives", std::move(primitives)}});
    }
  }

  static void copy_numbers(const json& from, const char* name, std::size_t count, json& to) {
    const auto found = from.find(name);
    if (found == from.end()) return;
    const bool good = found->is_array() && found->size() == count &&
                      std::all_of(found->begin(), found->end(), [](const json& v) { return v.is_number(); });
    if (!good) corrupt(fmt::format("a node's \"{}\" is not {} numbers", name, count));
    to[name] = *found;
  }

  void copy_nodes() {
    const json& nodes = list(source_, "nodes");
    const json& meshes = list(source_, "meshes");
    std::vector<bool> has_parent(nodes.size(), false);
    result_["nodes"] = json::array();
    for (const json& node : nodes) {
      if (!node.is_object()) corrupt("a node is not an object");
      json copy = json::object();
      copy_numbers(node, "matrix", 16, copy);
      copy_numbers(node, "translation", 3, copy);
      copy_numbers(node, "rotation", 4, copy);
      copy_numbers(node, "scale", 3, copy);
      if (node.contains("mesh")) {
        const std::uint64_t mesh = index(node, "mesh", meshes);
        if (!result_["meshes"][mesh]["primitives"].empty()) copy["mesh"] = mesh;
      }
      for (const json& child : list(node, "children")) {
        if (!child.is_number_unsigned() || child.get<std::uint64_t>() >= nodes.size() ||
            has_parent[child.get<std::uint64_t>()]) {
          corrupt("the nodes are no tree");
        }
        has_parent[child.get<std::uint64_t>()] = true;
        copy["children"].push_back(child);
      }
      result_["nodes"].push_back(std::move(copy));
    }
    copy_scene(has_parent);
  }

  void copy_scene(const std::vector<bool>& has_parent) {
    const json& nodes = list(source_, "nodes");
    json roots = json::array();
    const json& scenes = list(source_, "scenes");
    if (scenes.empty()) {
      for (std::size_t i = 0; i < nodes.size(); ++i) {
        if (!has_parent[i]) roots.push_back(i);
      }
    } else {
      const json& scene = scenes[number(source_, "scene", scenes.size() - 1, 0)];
      if (!scene.is_object()) corrupt("a scene is not an object");
      std::vector<bool> named(nodes.size(), false);
      for (const json& root : list(scene, "nodes")) {
        if (!root.is_number_unsigned() || root.get<std::uint64_t>() >= nodes.size() ||
            has_parent[root.get<std::uint64_t>()] || named[root.get<std::uint64_t>()]) {
          corrupt("a scene names a node that is no root");
        }
        named[root.get<std::uint64_t>()] = true;
        roots.push_back(root);
      }
    }
    // Every node has one parent at most, so going down from roots ends; deep trees are not for recursion.
    std::vector<std::pair<std::uint64_t, std::size_t>> open;
    for (const json& root : roots) open.emplace_back(root.get<std::uint64_t>(), 1);
    while (!open.empty()) {
      const auto [node, depth] = open.back();
      open.pop_back();
      if (depth > max_node_depth) corrupt(fmt::format("the nodes stand deeper than {}", max_node_depth));
      for (const json& child : list(result_["nodes"][node], "children")) {
        open.emplace_back(child.get<std::uint64_t>(), depth + 1);
      }
    }
    if (roots.empty()) corrupt("the scene is empty");
    result_["scene"] = 0;
    result_["scenes"] = json::array({{{"nodes", std::move(roots)}}});
  }

  const json& source_;
  const ReferenceOptions& options_;
  json result_ = json::object();
  FilesInMemory files_;
  std::vector<std::optional<std::uint64_t>> copied_;
};

}  // namespace

Result<FilesInMemory> geometry_of_gltf(std::span<const std::byte> content, ReferenceFormat format,
                                       const ReferenceOptions& options, const FindBuffer& find_buffer) {
  try {
    const Container container =
        format == ReferenceFormat::glb ? open_glb(content) : Container{as_text(content), std::nullopt};
    const json source = parse(container.text);
    return Reducer(source, options).reduce(container.binary, find_buffer);
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
