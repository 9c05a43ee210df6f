#include "common/codec/mesh_codec.h"

#include <meshoptimizer.h>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>

#include <fmt/core.h>

#include "common/codec/vertex_residuals.h"

namespace handloft::codec {
namespace {

static_assert(std::endian::native == std::endian::little,
              "the wire is little-endian, and so is the copy of it");

/// meshoptimizer's vertex codec wants strides that are multiples of four: the fourth component is padding.
using PaddedPosition = std::array<std::uint16_t, 4>;

constexpr double position_levels = 65535.0;
constexpr float normal_levels = 2047.0F;
constexpr std::uint8_t opaque = 255;

Error too_many(std::string_view field, std::size_t found, std::size_t limit) {
  return make_error(ErrorCode::resource_exhausted, fmt::format("found {}, expected at most {}", found, limit),
                    std::string(field));
}

Error wrong(ErrorCode code, std::string_view field, std::string message) {
  return make_error(code, std::move(message), std::string(field));
}

bool is_coordinate(double value, const MeshLimits& limits) {
  return std::isfinite(value) && std::abs(value) <= limits.max_coordinate_m;
}

Status check_vertices(const MeshData& mesh, const MeshLimits& limits) {
  constexpr ErrorCode bad = ErrorCode::invalid_argument;
  const std::size_t count = mesh.positions.size();
  if (count > limits.max_vertices) return too_many("positions", count, limits.max_vertices);
  if (mesh.normals.size() != count) {
    return wrong(bad, "normals",
                 fmt::format("found {}, expected one for each of {} positions", mesh.normals.size(), count));
  }
  if (mesh.opacity.size() != count) {
    return wrong(bad, "opacity",
                 fmt::format("found {}, expected one for each of {} positions", mesh.opacity.size(), count));
  }
  if (mesh.row > count) {
    return wrong(bad, "row", fmt::format("found {}, expected at most all {} vertices", mesh.row, count));
  }
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!is_coordinate(mesh.positions[i][axis], limits)) {
        return wrong(bad, fmt::format("positions[{}][{}]", i, axis),
                     fmt::format("found {}, expected a number within {} m", mesh.positions[i][axis],
                                 limits.max_coordinate_m));
      }
      if (!std::isfinite(mesh.normals[i][axis])) {
        return wrong(bad, fmt::format("normals[{}][{}]", i, axis),
                     fmt::format("found {}, expected a number", mesh.normals[i][axis]));
      }
    }
  }
  return {};
}

Status check_triangles(const MeshData& mesh, const MeshLimits& limits) {
  constexpr ErrorCode bad = ErrorCode::invalid_argument;
  const std::size_t count = mesh.positions.size();
  if (mesh.indices.size() > limits.max_indices)
    return too_many("indices", mesh.indices.size(), limits.max_indices);
  if (mesh.indices.size() % 3 != 0) {
    return wrong(bad, "indices", fmt::format("found {}, expected three a triangle", mesh.indices.size()));
  }
  for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
    if (mesh.indices[i] >= count) {
      return wrong(bad, fmt::format("indices[{}]", i),
                   fmt::format("found {}, expected less than {} vertices", mesh.indices[i], count));
    }
  }
  return {};
}

template <typename Packed>
std::string encode_vertices(const std::vector<Packed>& vertices) {
  std::string bytes(meshopt_encodeVertexBufferBound(vertices.size(), sizeof(Packed)), '\0');
  bytes.resize(meshopt_encodeVertexBuffer(reinterpret_cast<unsigned char*>(bytes.data()), bytes.size(),
                                          vertices.data(), vertices.size(), sizeof(Packed)));
  return bytes;
}

template <typename Packed>
bool decode_vertices(const std::string& bytes, std::vector<Packed>& vertices) {
  return meshopt_decodeVertexBuffer(vertices.data(), vertices.size(), sizeof(Packed),
                                    reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()) == 0;
}

/// As the message has them, in either coding. Its count is known to be within the limits.
Result<QuantisedVertices> read_vertices(const v1::Mesh& message) {
  constexpr ErrorCode bad = ErrorCode::data_corrupt;
  const std::size_t count = message.vertex_count();
  if (!message.residuals().empty()) return unpack_residuals(message.residuals(), count, message.row());
  // Opacity has a byte for each of them, so that a short message cannot ask for much memory here.
  std::vector<PaddedPosition> padded(count);
  if (!decode_vertices(message.positions(), padded)) {
    return wrong(
        bad, "positions",
        fmt::format("{} bytes are not a vertex stream of {} vertices", message.positions().size(), count));
  }
  QuantisedVertices vertices;
  vertices.normals.resize(count);
  if (!decode_vertices(message.normals(), vertices.normals)) {
    return wrong(
        bad, "normals",
        fmt::format("{} bytes are not a vertex stream of {} vertices", message.normals().size(), count));
  }
  vertices.positions.resize(count);
  for (std::size_t i = 0; i < count; ++i) vertices.positions[i] = {padded[i][0], padded[i][1], padded[i][2]};
  return vertices;
}

}  // namespace

std::array<std::int16_t, 2> encode_octahedral(const std::array<float, 3>& normal) {
  const float sum = std::abs(normal[0]) + std::abs(normal[1]) + std::abs(normal[2]);
  if (!(sum > 0.0F) || !std::isfinite(sum)) return {0, 0};
  float x = normal[0] / sum;
  float y = normal[1] / sum;
  if (normal[2] < 0.0F) {
    const float folded_x = (1.0F - std::abs(y)) * std::copysign(1.0F, x);
    y = (1.0F - std::abs(x)) * std::copysign(1.0F, y);
    x = folded_x;
  }
  const auto level = [](float value) {  // To the nearest, without the library's call.
    return static_cast<std::int16_t>(static_cast<int>(value * normal_levels + std::copysign(0.5F, value)));
  };
  return {level(x), level(y)};
}

std::array<float, 3> decode_octahedral(std::int16_t packed_x, std::int16_t packed_y) {
  float x = std::clamp(static_cast<float>(packed_x) / normal_levels, -1.0F, 1.0F);
  float y = std::clamp(static_cast<float>(packed_y) / normal_levels, -1.0F, 1.0F);
  const float z = 1.0F - std::abs(x) - std::abs(y);
  if (z < 0.0F) {
    const float unfolded_x = (1.0F - std::abs(y)) * std::copysign(1.0F, x);
    y = (1.0F - std::abs(x)) * std::copysign(1.0F, y);
    x = unfolded_x;
  }
  const float length = std::sqrt(x * x + y * y + z * z);  // |x|+|y|+|z| = 1, so that it is at least 1/sqrt(3)
  return {x / length, y / length, z / length};
}

namespace {

/// To the nearest, for what is not negative: a drag asks for it 150,000 times a frame, and the library's
/// round is a call each.
template <typename Integer>
Integer nearest(double value) {
  return static_cast<Integer>(value + 0.5);  // NOLINT(bugprone-incorrect-roundings): see above.
}

/// Everything but the triangles. Precondition: check_vertices().
void write_vertices(const MeshData& mesh, v1::Mesh& message) {
  message.set_vertex_count(static_cast<std::uint32_t>(mesh.positions.size()));
  if (mesh.positions.empty()) return;
  std::array<float, 3> low = mesh.positions.front();
  std::array<float, 3> high = low;
  for (const auto& position : mesh.positions) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], position[axis]);
      high[axis] = std::max(high[axis], position[axis]);
    }
  }
  double extent = 0.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    extent = std::max(extent, static_cast<double>(high[axis]) - static_cast<double>(low[axis]));
  }
  const double step = extent / position_levels;
  message.mutable_origin()->set_x(static_cast<double>(low[0]));
  message.mutable_origin()->set_y(static_cast<double>(low[1]));
  message.mutable_origin()->set_z(static_cast<double>(low[2]));
  message.set_step_m(step);

  // A step may be so small that its reciprocal overflows; then divide.
  const double reciprocal = step > 0.0 ? 1.0 / step : 0.0;
  const bool multiplies = std::isfinite(reciprocal);
  QuantisedVertices vertices;
  vertices.positions.resize(mesh.positions.size());
  vertices.normals.resize(mesh.positions.size());
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    for (std::size_t axis = 0; axis < 3 && step > 0.0; ++axis) {
      const double offset = static_cast<double>(mesh.positions[i][axis]) - static_cast<double>(low[axis]);
      const double levels = multiplies ? offset * reciprocal : offset / step;
      vertices.positions[i][axis] = nearest<std::uint16_t>(std::min(levels, position_levels));
    }
    vertices.normals[i] = encode_octahedral(mesh.normals[i]);
  }
  message.set_row(mesh.row);
  message.set_residuals(pack_residuals(vertices, mesh.row));
  if (std::any_of(mesh.opacity.begin(), mesh.opacity.end(), [](auto one) { return one != opaque; }))
    message.set_opacity(std::string(mesh.opacity.begin(), mesh.opacity.end()));
}

}  // namespace

Result<v1::Mesh> encode_mesh(const MeshData& mesh, const MeshLimits& limits) {
  if (const Status checked = check_vertices(mesh, limits); !checked) return checked.error();
  if (const Status checked = check_triangles(mesh, limits); !checked) return checked.error();
  v1::Mesh message;
  write_vertices(mesh, message);
  message.set_index_count(static_cast<std::uint32_t>(mesh.indices.size()));
  if (!mesh.indices.empty()) {
    std::string bytes(meshopt_encodeIndexBufferBound(mesh.indices.size(), mesh.positions.size()), '\0');
    bytes.resize(meshopt_encodeIndexBuffer(reinterpret_cast<unsigned char*>(bytes.data()), bytes.size(),
                                           mesh.indices.data(), mesh.indices.size()));
    message.set_indices(std::move(bytes));
  }
  return message;
}

Result<v1::Mesh> encode_mesh(const MeshData& mesh, const v1::Mesh& same_triangles, const MeshLimits& limits) {
  if (const Status checked = check_vertices(mesh, limits); !checked) return checked.error();
  if (mesh.positions.size() != same_triangles.vertex_count()) {
    return wrong(ErrorCode::invalid_argument, "positions",
                 fmt::format("found {}, expected as many as the triangles were made for, {}",
                             mesh.positions.size(), same_triangles.vertex_count()));
  }
  v1::Mesh message;
  write_vertices(mesh, message);
  message.set_index_count(same_triangles.index_count());
  message.set_indices(same_triangles.indices());
  message.set_topology(same_triangles.topology());
  return message;
}

Result<v1::Mesh> as_vertex_streams(const v1::Mesh& message) {
  v1::Mesh plain = message;
  plain.clear_residuals();
  plain.clear_row();
  if (message.residuals().empty() || message.vertex_count() == 0) return plain;
  const Result<QuantisedVertices> vertices = read_vertices(message);
  if (!vertices) return vertices.error();
  std::vector<PaddedPosition> padded(vertices->positions.size());
  for (std::size_t i = 0; i < padded.size(); ++i) {
    const auto& position = vertices->positions[i];
    padded[i] = {position[0], position[1], position[2], 0};
  }
  plain.set_positions(encode_vertices(padded));
  plain.set_normals(encode_vertices(vertices->normals));
  if (plain.opacity().empty()) plain.set_opacity(std::string(padded.size(), static_cast<char>(opaque)));
  return plain;
}

Result<MeshData> decode_mesh(const v1::Mesh& message, const MeshLimits& limits, const KnownTriangles& known) {
  constexpr ErrorCode bad = ErrorCode::data_corrupt;
  const std::size_t count = message.vertex_count();
  const std::size_t index_count = message.index_count();
  if (count > limits.max_vertices) return too_many("vertex_count", count, limits.max_vertices);
  if (index_count > limits.max_indices) return too_many("index_count", index_count, limits.max_indices);
  if (index_count % 3 != 0) {
    return wrong(bad, "index_count", fmt::format("found {}, expected three a triangle", index_count));
  }
  const bool predicted = !message.residuals().empty();
  if (!(predicted && message.opacity().empty()) && message.opacity().size() != count) {
    return wrong(
        bad, "opacity",
        fmt::format("found {} bytes, expected one for each of {} vertices", message.opacity().size(), count));
  }
  const bool left_out = message.topology() != 0 && message.indices().empty() && index_count != 0;
  if (left_out && (message.topology() != known.topology || known.indices.size() != index_count)) {
    return wrong(
        bad, "indices",
        fmt::format("found none, but the {} of topology {} are not known", index_count, message.topology()));
  }
  if (!left_out && message.indices().size() < index_count / 3) {
    return wrong(bad, "indices",
                 fmt::format("found {} bytes, expected at least one for each of {} triangles",
                             message.indices().size(), index_count / 3));
  }
  MeshData mesh;
  if (count == 0) {
    if (index_count != 0)
      return wrong(bad, "index_count", fmt::format("found {} without a vertex, expected 0", index_count));
    return mesh;
  }
  const double step = message.step_m();
  if (!std::isfinite(step) || step < 0.0 || step * position_levels > 2.0 * limits.max_coordinate_m) {
    return wrong(
        bad, "step_m",
        fmt::format("found {}, expected 0..{}", step, 2.0 * limits.max_coordinate_m / position_levels));
  }
  const std::array<double, 3> origin{message.origin().x(), message.origin().y(), message.origin().z()};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!is_coordinate(origin[axis], limits)) {
      return wrong(
          bad, fmt::format("origin.{}", "xyz"[axis]),
          fmt::format("found {}, expected a number within {} m", origin[axis], limits.max_coordinate_m));
    }
  }

  const Result<QuantisedVertices> vertices = read_vertices(message);
  if (!vertices) return vertices.error();
  if (left_out) {
    mesh.indices.assign(known.indices.begin(), known.indices.end());
  } else {
    mesh.indices.resize(index_count);
  }
  if (index_count != 0 && !left_out &&
      meshopt_decodeIndexBuffer(mesh.indices.data(), index_count, sizeof(std::uint32_t),
                                reinterpret_cast<const unsigned char*>(message.indices().data()),
                                message.indices().size()) != 0) {
    return wrong(
        bad, "indices",
        fmt::format("{} bytes are not an index stream of {} indices", message.indices().size(), index_count));
  }
  for (std::size_t i = 0; i < index_count; ++i) {
    if (mesh.indices[i] >= count) {
      return wrong(bad, fmt::format("indices[{}]", i),
                   fmt::format("found {}, expected less than {} vertices", mesh.indices[i], count));
    }
  }
  mesh.positions.resize(count);
  mesh.normals.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      mesh.positions[i][axis] = static_cast<float>(origin[axis] + step * vertices->positions[i][axis]);
    }
    mesh.normals[i] = decode_octahedral(vertices->normals[i][0], vertices->normals[i][1]);
  }
  if (message.opacity().empty()) {
    mesh.opacity.assign(count, opaque);
  } else {
    mesh.opacity.assign(message.opacity().begin(), message.opacity().end());
  }
  mesh.row = predicted ? message.row() : 0;
  return mesh;
}

}  // namespace handloft::codec
