#pragma once
// Half-edge meshes (OpenMesh) for what needs connectivity: checking topology, vertex normals, decimation.

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <cstddef>

#include "common/base/result.h"
#include "server-model/geometry/tessellate.h"

namespace handloft::geometry {

struct TriMeshTraits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
  VertexAttributes(OpenMesh::Attributes::Status | OpenMesh::Attributes::Normal);
  FaceAttributes(OpenMesh::Attributes::Status | OpenMesh::Attributes::Normal);
  EdgeAttributes(OpenMesh::Attributes::Status);
  HalfedgeAttributes(OpenMesh::Attributes::Status | OpenMesh::Attributes::PrevHalfedge);
};
using TriMesh = OpenMesh::TriMesh_ArrayKernelT<TriMeshTraits>;

/// Builds the half-edge mesh; vertex i stays vertex i. Errors: invalid_argument for an index out of range, a
/// triangle with a vertex twice, or an edge or vertex that is not a two-manifold.
Result<TriMesh> to_trimesh(const TriangleMesh& mesh);

/// Back to arrays, with vertex normals from the faces and opacity 1. Deleted elements are left out.
TriangleMesh from_trimesh(TriMesh mesh);

struct MeshTopology {
  std::size_t vertices = 0;
  std::size_t edges = 0;
  std::size_t faces = 0;
  std::size_t components = 0;
  std::size_t boundary_loops = 0;
  std::size_t isolated_vertices = 0;

  /// V - E + F: 1 for a disk, 2 for a closed sphere.
  long euler_characteristic() const {
    return static_cast<long>(vertices) - static_cast<long>(edges) + static_cast<long>(faces);
  }
};
MeshTopology topology(const TriMesh& mesh);

/// Collapses edges by quadric error (Garland and Heckbert) down to target_faces, or as near as the boundary
/// lets: its vertices stay. Errors: invalid_argument for a target of 0.
Result<TriMesh> decimate(TriMesh mesh, std::size_t target_faces);

}  // namespace handloft::geometry
