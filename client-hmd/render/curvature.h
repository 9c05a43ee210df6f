#pragma once
// Principal curvatures at the vertices of a mesh, after Rusinkiewicz, "Estimating Curvatures and Their
// Derivatives on Triangle Meshes" (3DPVT 2004): in every triangle the second fundamental form that fits the
// differences of the normals along its three edges best; at a vertex their mean, each turned into the
// vertex's tangent plane and weighted by the part of the triangle that is nearest to the vertex (its Voronoi
// area).
//
// Normals that came over the wire are rounded (common/codec/mesh_codec.h: 2 x 12 bits, about 0.2 mrad), which
// a short edge turns into noise of curvature. So where edges are short, the forms are averaged over
// neighbours until that noise is small; on a mesh of a curve's true detail that blurs no more than a few
// edges.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "client-hmd/mirror/scene.h"
#include "client-hmd/render/look.h"

namespace handloft::client {

/// 1/m, largest >= smallest; positive where the surface bends away from its normal, as a ball from its
/// outside.
struct PrincipalCurvatures {
  float largest = 0.0F;
  float smallest = 0.0F;
};

struct CurvatureOptions {
  float normal_noise_rad = 2e-4F;    ///< Standard deviation: 12-bit octahedral normals.
  float wanted_noise_per_m = 0.25F;  ///< A hundredth of what a hand-held shape has (40 mm: 25/m).
  int max_smoothing = 8;  ///< Rounds of averaging with neighbours; costs a tenth of the whole each.
};

/// One a vertex. A vertex of no triangle of any area is flat. Never NaN, whatever the mesh; indices beyond
/// the vertices are passed over. A million triangles take about a quarter of a second: call it off the frame
/// loop.
std::vector<PrincipalCurvatures> vertex_curvatures(std::span<const SurfaceVertex> vertices,
                                                   std::span<const std::uint32_t> indices,
                                                   const CurvatureOptions& options = {});

/// 1/m; Gaussian curvature as its root with its sign.
float curvature_value(const PrincipalCurvatures& curvatures, CurvatureKind kind);

/// What the colours should span on either side of nought so that `share` of the seen vertices (opacity at
/// least 0.5) lie within, rounded up to a plain number; at least 0.1/m (a radius of 10 m), which a flat sheet
/// gets.
float curvature_range(std::span<const PrincipalCurvatures> curvatures,
                      std::span<const SurfaceVertex> vertices, CurvatureKind kind, float share = 0.95F);

/// The next of 1, 1.5, 2, 3, 5, 7.5 and their tenfolds that is not below; of what is not positive, the least.
float plain_number_above(float value);

}  // namespace handloft::client
