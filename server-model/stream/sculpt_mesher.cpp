#include "server-model/stream/sculpt_mesher.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "server-model/geometry/bspline_tessellate.h"
#include "server-model/model/sculpt_place.h"

namespace handloft::stream {

using geometry::BSplineSurface;
using geometry::GridParameters;
using geometry::KnotVector;
using geometry::Vec2;
using geometry::Vec3;

namespace {

constexpr std::uint8_t opaque = 255;
/// Below this part of the product of two tangents' lengths, their cross product says little of the normal.
constexpr double least_sine = 1e-9;
/// A mesh may have so many times the vertices that a new one would have, or lack so much, and stay.
constexpr double most_surplus = 4.0, most_lack = 1.25;

std::array<float, 3> to_floats(const Vec3& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

/// At least so many parts altogether, spread evenly over the spans that have fewer than their share.
std::vector<double> at_least(const std::vector<double>& lines, const KnotVector& knots, int least_parts) {
  const std::vector<int> spans = knots.spans();
  const int least = (least_parts + static_cast<int>(spans.size()) - 1) / static_cast<int>(spans.size());
  std::vector<double> result;
  auto at = lines.begin();
  for (const int s : spans) {
    const double low = knots.knots()[static_cast<std::size_t>(s)];
    const double high = knots.knots()[static_cast<std::size_t>(s) + 1];
    const auto end = std::lower_bound(at, lines.end(), high);
    const int parts = std::max(least, static_cast<int>(end - at));
    for (int k = 0; k < parts; ++k) result.push_back(low + (high - low) * k / parts);
    at = end;
  }
  result.push_back(knots.upper());
  return result;
}

/// Every so many of the spans' bounds, and the last.
std::vector<double> thinned(const KnotVector& knots, std::size_t step) {
  const std::vector<int> spans = knots.spans();
  std::vector<double> result;
  for (std::size_t k = 0; k < spans.size(); k += step)
    result.push_back(knots.knots()[static_cast<std::size_t>(spans[k])]);
  result.push_back(knots.upper());
  return result;
}

double chord_of(const BSplineSurface& surface, const SculptMeshOptions& options) {
  Eigen::AlignedBox3d box;
  for (const Vec3& point : surface.control) box.extend(point);
  return box.isEmpty() ? options.chord_tolerance_m
                       : std::max(options.chord_tolerance_m, options.chord_fraction * box.diagonal().norm());
}

/// Whose vertex comes where for vertices in a row to be neighbours, which pack better: along lines of one u,
/// line after line, and then what is on no such line (on a trim), as it came.
std::vector<std::uint32_t> along_lines(const std::vector<Vec2>& places) {
  constexpr std::uint32_t fewest_on_a_line = 4;
  std::map<double, std::uint32_t> on_line;
  for (const Vec2& place : places) ++on_line[place.x()];
  const auto is_on_line = [&](std::uint32_t k) { return on_line[places[k].x()] >= fewest_on_a_line; };
  std::vector<std::uint32_t> order(places.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto rest = std::stable_partition(order.begin(), order.end(), is_on_line);
  std::sort(order.begin(), rest, [&](std::uint32_t a, std::uint32_t b) {
    return std::pair(places[a].x(), places[a].y()) < std::pair(places[b].x(), places[b].y());
  });
  return order;
}

}  // namespace

Result<GridParameters> sculpt_grid(const BSplineSurface& surface, const SculptMeshOptions& options) {
  const auto spans = static_cast<double>(surface.u.spans().size() * surface.v.spans().size());
  if (spans >= static_cast<double>(options.max_vertices)) {
    const double share = spans / static_cast<double>(options.max_vertices);
    const auto step = static_cast<std::size_t>(std::ceil(std::sqrt(std::max(1.0, share))));
    return GridParameters{thinned(surface.u, step), thinned(surface.v, step)};
  }
  constexpr int most_doublings = 40;
  double tolerance = chord_of(surface, options);
  Result<GridParameters> grid = geometry::grid_within(surface, tolerance, options.max_vertices);
  for (int i = 0; !grid && grid.error().code == ErrorCode::resource_exhausted && i < most_doublings; ++i) {
    tolerance *= 2;
    grid = geometry::grid_within(surface, tolerance, options.max_vertices);
  }
  if (!grid && grid.error().code == ErrorCode::resource_exhausted) grid = geometry::even_grid(surface, 1);
  if (!grid) return grid;
  return GridParameters{at_least(grid->us, surface.u, options.least_parts),
                        at_least(grid->vs, surface.v, options.least_parts)};
}

SculptMesher::SculptMesher(const model::SculptShape& shape)
    : u_(shape.surface->u),
      v_(shape.surface->v),
      weights_(shape.surface->weights),
      trim_(shape.trim),
      reversed_(shape.reversed) {}

Result<SculptMesher> SculptMesher::create(const model::SculptShape& shape, std::uint64_t topology,
                                          const SculptMeshOptions& options) {
  if (!shape.trim) {
    const Result<GridParameters> grid = sculpt_grid(*shape.surface, options);
    if (!grid) return grid.error();
    return create(shape, topology, *grid);
  }
  SculptMesher mesher(shape);
  geometry::SurfaceMeshOptions meshing;
  meshing.chord_tolerance_m = chord_of(*shape.surface, options);
  meshing.max_vertices = options.max_vertices;
  meshing.largest_cell = 1.0 / options.least_parts;
  auto mesh = geometry::tessellate(*shape.surface, model::trim_loops(shape), meshing, &mesher.places_);
  if (!mesh) return mesh.error();
  const std::vector<std::uint32_t> order = along_lines(mesher.places_);
  std::vector<std::uint32_t> now_at(order.size());
  std::vector<Vec2> places;
  for (const std::uint32_t before : order) {
    now_at[before] = static_cast<std::uint32_t>(places.size());
    places.push_back(mesher.places_[before]);
  }
  mesher.places_ = std::move(places);
  for (std::uint32_t& index : mesh->indices) index = now_at[index];
  std::vector<double> us, vs;
  for (const Vec2& place : mesher.places_) {
    us.push_back(place.x());
    vs.push_back(place.y());
  }
  mesher.in_u_ = geometry::tabulate(mesher.u_, us, 1);
  mesher.in_v_ = geometry::tabulate(mesher.v_, vs, 1);
  if (const Status ready = mesher.prepare(std::move(mesh->indices), topology); !ready) return ready.error();
  mesher.evaluate_places(*shape.surface);
  return mesher;
}

Result<SculptMesher> SculptMesher::create(const model::SculptShape& shape, std::uint64_t topology,
                                          const GridParameters& grid) {
  SculptMesher mesher(shape);
  Result<geometry::GridTessellation> made = geometry::GridTessellation::create(*shape.surface, grid);
  if (!made) return made.error();
  const geometry::TriangleMesh& mesh = made->mesh();
  std::vector<std::uint32_t> indices = mesh.indices;
  mesher.places_.resize(mesh.vertex_count());
  mesher.vertices_.row = static_cast<std::uint32_t>(made->columns());
  if (const Status ready = mesher.prepare(std::move(indices), topology); !ready) return ready.error();
  mesher.places_.clear();
  for (std::size_t i = 0; i < mesh.vertex_count(); ++i) mesher.take(i, mesh.positions[i], mesh.normals[i]);
  mesher.grid_.push_back(*std::move(made));
  return mesher;
}

Status SculptMesher::prepare(std::vector<std::uint32_t> indices, std::uint64_t topology) {
  if (reversed_) {
    for (std::size_t i = 0; i + 2 < indices.size(); i += 3) std::swap(indices[i + 1], indices[i + 2]);
  }
  const std::size_t count = places_.size();
  vertices_.positions.assign(count, {});
  vertices_.normals.assign(count, {0.0F, 0.0F, 1.0F});
  vertices_.opacity.assign(count, opaque);
  vertices_.indices = std::move(indices);
  Result<v1::Mesh> packed = codec::encode_mesh(vertices_);
  if (!packed) return packed.error();
  triangles_.set_vertex_count(packed->vertex_count());
  triangles_.set_index_count(packed->index_count());
  triangles_.set_indices(packed->indices());
  triangles_.set_topology(topology);
  vertices_.indices = {};
  return {};
}

bool SculptMesher::fits(const model::SculptShape& shape) const {
  return u_ == shape.surface->u && v_ == shape.surface->v && weights_ == shape.surface->weights &&
         trim_ == shape.trim && reversed_ == shape.reversed;
}

bool SculptMesher::fine_enough(const model::SculptShape& shape, const SculptMeshOptions& options) const {
  // What is made for a trimmed face is known only when it is made, and it is made when a drag has ended.
  if (grid_.empty()) return false;
  const Result<GridParameters> grid = sculpt_grid(*shape.surface, options);
  if (!grid) return true;
  const auto wanted = static_cast<double>(grid->us.size() * grid->vs.size());
  const auto has = static_cast<double>(vertices_.positions.size());
  return wanted <= most_lack * has && has <= most_surplus * wanted;
}

void SculptMesher::take(std::size_t vertex, const Vec3& place, const Vec3& normal) {
  vertices_.positions[vertex] = to_floats(place);
  vertices_.normals[vertex] = to_floats(reversed_ ? Vec3(-normal) : normal);
}

void SculptMesher::evaluate_places(const BSplineSurface& surface) {
  const bool rational = surface.is_rational();
  for (std::size_t k = 0; k < places_.size(); ++k) {
    const auto value_u = in_u_.at(k, 0), slope_u = in_u_.at(k, 1);
    const auto value_v = in_v_.at(k, 0), slope_v = in_v_.at(k, 1);
    Vec3 s = Vec3::Zero(), su = s, sv = s;
    double w = 0, wu = 0, wv = 0;
    for (std::size_t a = 0; a < value_u.size(); ++a) {
      const int row = surface.u.control_of(in_u_.first_function[k] + static_cast<int>(a));
      for (std::size_t b = 0; b < value_v.size(); ++b) {
        const std::size_t n =
            surface.index(row, surface.v.control_of(in_v_.first_function[k] + static_cast<int>(b)));
        const double weight = rational ? surface.weights[n] : 1.0;
        const double by = weight * value_u[a] * value_v[b];
        const double by_u = weight * slope_u[a] * value_v[b], by_v = weight * value_u[a] * slope_v[b];
        s += by * surface.control[n];
        su += by_u * surface.control[n];
        sv += by_v * surface.control[n];
        w += by;
        wu += by_u;
        wv += by_v;
      }
    }
    if (rational) {
      s /= w;
      su = (su - wu * s) / w;
      sv = (sv - wv * s) / w;
    }
    const Vec3 across = su.cross(sv);
    const double length = across.norm();
    take(k, s,
         length > least_sine * su.norm() * sv.norm() ? Vec3(across / length)
                                                     : surface.normal(places_[k].x(), places_[k].y()));
  }
}

Status SculptMesher::evaluate(const BSplineSurface& surface, const geometry::ParallelFor& parallel) {
  if (grid_.empty()) {
    evaluate_places(surface);
    return {};
  }
  geometry::GridTessellation& grid = grid_.front();
  if (const Status updated = grid.update(surface.control, parallel); !updated) return updated;
  for (const std::uint32_t vertex : grid.changed())
    take(vertex, grid.mesh().positions[vertex], grid.mesh().normals[vertex]);
  return {};
}

Result<v1::Mesh> SculptMesher::pack() const {
  return codec::encode_mesh(vertices_, triangles_);
}

Result<v1::Mesh> SculptMesher::mesh(const BSplineSurface& surface, const geometry::ParallelFor& parallel) {
  if (const Status evaluated = evaluate(surface, parallel); !evaluated) return evaluated.error();
  return pack();
}

}  // namespace handloft::stream
