#include "server-model/geometry/trimesh.h"

#include <fmt/format.h>

#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalFlippingT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>
#include <algorithm>
#include <array>
#include <unordered_set>
#include <vector>

namespace handloft::geometry {
namespace {

OpenMesh::Vec3d to_openmesh(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}
Vec3 to_eigen(const OpenMesh::Vec3d& v) {
  return {v[0], v[1], v[2]};
}

std::uint64_t directed_edge(std::uint32_t from, std::uint32_t to) {
  return (static_cast<std::uint64_t>(from) << 32) | to;
}

}  // namespace

Result<TriMesh> to_trimesh(const TriangleMesh& mesh) {
  if (mesh.indices.size() % 3 != 0) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} indices, expected three per triangle", mesh.indices.size()),
                      "indices");
  }
  TriMesh result;
  result.reserve(mesh.vertex_count(), 3 * mesh.triangle_count(), mesh.triangle_count());
  for (const Vec3& position : mesh.positions) result.add_vertex(to_openmesh(position));
  std::unordered_set<std::uint64_t> edges;
  edges.reserve(mesh.indices.size());
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
    const std::array<std::uint32_t, 3> v{mesh.indices[3 * t], mesh.indices[3 * t + 1],
                                         mesh.indices[3 * t + 2]};
    const std::string field = fmt::format("triangles[{}]", t);
    if (std::max({v[0], v[1], v[2]}) >= mesh.vertex_count()) {
      return make_error(
          ErrorCode::invalid_argument,
          fmt::format("found index {}, expected below {}", std::max({v[0], v[1], v[2]}), mesh.vertex_count()),
          field);
    }
    if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) {
      return make_error(ErrorCode::invalid_argument, "found the same vertex twice", field);
    }
    for (std::size_t k = 0; k < 3; ++k) {
      if (!edges.insert(directed_edge(v[k], v[(k + 1) % 3])).second) {
        return make_error(
            ErrorCode::invalid_argument,
            fmt::format("the edge {} - {} has two triangles on the same side", v[k], v[(k + 1) % 3]), field);
      }
    }
    const auto handle = [](std::uint32_t index) { return OpenMesh::VertexHandle(static_cast<int>(index)); };
    if (!result.add_face(handle(v[0]), handle(v[1]), handle(v[2])).is_valid()) {
      return make_error(ErrorCode::invalid_argument, "the mesh is not a two-manifold here", field);
    }
  }
  result.update_normals();
  return result;
}

TriangleMesh from_trimesh(TriMesh mesh) {
  mesh.garbage_collection();
  mesh.update_normals();
  TriangleMesh result;
  result.positions.reserve(mesh.n_vertices());
  for (const auto v : mesh.vertices()) {
    result.positions.push_back(to_eigen(mesh.point(v)));
    result.normals.push_back(to_eigen(mesh.normal(v)));
  }
  result.opacity.assign(mesh.n_vertices(), 1.0);
  result.indices.reserve(3 * mesh.n_faces());
  for (const auto f : mesh.faces()) {
    for (const auto v : mesh.fv_range(f)) result.indices.push_back(static_cast<std::uint32_t>(v.idx()));
  }
  return result;
}

MeshTopology topology(const TriMesh& mesh) {
  MeshTopology result;
  result.vertices = mesh.n_vertices();
  result.edges = mesh.n_edges();
  result.faces = mesh.n_faces();

  std::vector<bool> seen(mesh.n_vertices(), false);
  std::vector<OpenMesh::VertexHandle> front;
  for (const auto start : mesh.vertices()) {
    if (mesh.is_isolated(start)) {
      ++result.isolated_vertices;
      continue;
    }
    if (seen[static_cast<std::size_t>(start.idx())]) continue;
    ++result.components;
    seen[static_cast<std::size_t>(start.idx())] = true;
    front.push_back(start);
    while (!front.empty()) {
      const OpenMesh::VertexHandle v = front.back();
      front.pop_back();
      for (const auto neighbour : mesh.vv_range(v)) {
        const auto index = static_cast<std::size_t>(neighbour.idx());
        if (seen[index]) continue;
        seen[index] = true;
        front.push_back(neighbour);
      }
    }
  }

  std::vector<bool> walked(mesh.n_halfedges(), false);
  for (const auto start : mesh.halfedges()) {
    if (!mesh.is_boundary(start) || walked[static_cast<std::size_t>(start.idx())]) continue;
    ++result.boundary_loops;
    OpenMesh::HalfedgeHandle h = start;
    do {
      walked[static_cast<std::size_t>(h.idx())] = true;
      h = mesh.next_halfedge_handle(h);
    } while (h != start);
  }
  return result;
}

Result<TriMesh> decimate(TriMesh mesh, std::size_t target_faces) {
  if (target_faces == 0) {
    return make_error(ErrorCode::invalid_argument, "found 0, expected at least 1", "target_faces");
  }
  for (const auto v : mesh.vertices()) {
    if (mesh.is_boundary(v)) mesh.status(v).set_locked(true);
  }
  using Decimater = OpenMesh::Decimater::DecimaterT<TriMesh>;
  Decimater decimater(mesh);
  OpenMesh::Decimater::ModQuadricT<TriMesh>::Handle quadric;
  OpenMesh::Decimater::ModNormalFlippingT<TriMesh>::Handle flipping;
  decimater.add(quadric);
  decimater.add(flipping);
  decimater.module(quadric).unset_max_err();
  decimater.initialize();
  decimater.decimate_to_faces(0, target_faces);
  mesh.garbage_collection();
  for (const auto v : mesh.vertices()) mesh.status(v).set_locked(false);
  mesh.update_normals();
  return mesh;
}

}  // namespace handloft::geometry
