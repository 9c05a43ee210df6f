#include "server-model/geometry/bspline_projection.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "server-model/geometry/projector_data.h"

namespace handloft::geometry {

namespace detail {

namespace {

/// Degree d to d + 1: times a linear polynomial with these values at 0 and 1.
void multiply_linear(std::span<const double> f, double at0, double at1, std::span<double> out) {
  const std::size_t n = f.size();  // The product's degree.
  for (std::size_t i = 0; i <= n; ++i) {
    const double part = static_cast<double>(i) / static_cast<double>(n);
    out[i] = (i < n ? (1 - part) * at0 * f[i] : 0) + (i > 0 ? part * at1 * f[i - 1] : 0);
  }
}

/// sum_i B_i(x) f_i, x a linear polynomial of t in 0..1 from `from` to `to`, f_i Bernstein polynomials of t
/// of the same degree, one after another in `f`: de Casteljau with polynomials for numbers.
std::vector<double> compose(std::vector<double> f, std::size_t count, double from, double to) {
  std::size_t length = f.size() / count;
  std::vector<double> low(length + count), high(length + count);
  for (; count > 1; --count) {
    std::vector<double> next((count - 1) * (length + 1));
    for (std::size_t i = 0; i + 1 < count; ++i) {
      const std::span<const double> a(f.data() + i * length, length), b(f.data() + (i + 1) * length, length);
      multiply_linear(a, 1 - from, 1 - to, low);
      multiply_linear(b, from, to, high);
      for (std::size_t k = 0; k <= length; ++k) next[i * (length + 1) + k] = low[k] + high[k];
    }
    f = std::move(next);
    ++length;
  }
  return f;
}

}  // namespace

ProjectorData::ProjectorData(const BSplineSurface& surface, TrimRegion region, const ProjectorOptions& chosen)
    : options(chosen), pieces(surface), trim(std::move(region)), control(surface.control) {
  kinds.assign(pieces.size(), PieceKind::whole);
  if (!trim.empty()) {
    const std::vector<double>&us = pieces.u().bounds, &vs = pieces.v().bounds;
    for (const TrimRegion::Part& part : trim.parts(us, vs)) {
      const auto i = static_cast<std::size_t>(part.i), j = static_cast<std::size_t>(part.j);
      const Vec2 low(us[i], vs[j]), extent(us[i + 1] - us[i], vs[j + 1] - vs[j]);
      const auto local = [&](const Vec2& uv) {
        return Vec2((uv - low).cwiseQuotient(extent).cwiseMax(Vec2::Zero()).cwiseMin(Vec2::Ones()));
      };
      const std::size_t piece = pieces.index(part.i, part.j);
      edges.push_back({static_cast<std::uint32_t>(piece), local(part.from), local(part.to)});
      edges_of.resize(pieces.size());
      edges_of[piece].push_back(static_cast<std::uint32_t>(edges.size() - 1));
      kinds[piece] = PieceKind::crossed;
    }
    for (std::size_t piece = 0; piece < pieces.size(); ++piece) {
      if (kinds[piece] == PieceKind::whole && !trim.inside(pieces.parameters(piece, 0.5, 0.5))) {
        kinds[piece] = PieceKind::outside;
      }
    }
  }
  std::vector<std::uint8_t> keep(pieces.size());
  for (std::size_t piece = 0; piece < keep.size(); ++piece) keep[piece] = kinds[piece] != PieceKind::outside;
  tree = BoxTree::over_grid(pieces.rows(), pieces.columns(), keep);
  edge_tree = BoxTree::over_sequence(edges.size());
  edge_boxes.resize(edges.size());
  edge_curves.resize(edges.size() * edge_component() * (pieces.is_rational() ? 4 : 3));
  refit({});
}

bool ProjectorData::outside(std::size_t piece, const Vec2& low, const Vec2& high) const {
  if (kinds[piece] == PieceKind::whole) return false;
  const Vec2 centre_of = (low + high) / 2, half = (high - low) / 2;
  for (const std::uint32_t e : edges_of[piece]) {
    // Separating axes of a rectangle and a segment: u, v and across the segment; touching counts.
    const Vec2 a = edges[e].from - centre_of, b = edges[e].to - centre_of;
    const Vec2 least = a.cwiseMin(b), most = a.cwiseMax(b), across(b.y() - a.y(), a.x() - b.x());
    const bool apart = least.x() > half.x() || most.x() < -half.x() || least.y() > half.y() ||
                       most.y() < -half.y() ||
                       std::abs(across.dot(a)) > half.dot(across.cwiseAbs()) * (1 + 1e-9) + 1e-15;
    if (!apart) return false;
  }
  return !trim.inside(pieces.parameters(piece, centre_of.x(), centre_of.y()));
}

void ProjectorData::refit(std::span<const std::uint8_t> touched) {
  if (touched.empty()) {
    tree.refit(pieces.boxes());
  } else {
    tree.refit(pieces.boxes(), touched);
  }
  const std::size_t components = pieces.is_rational() ? 4 : 3, length = edge_component();
  const auto rows = static_cast<std::size_t>(pieces.degree_u()) + 1;
  const auto columns = static_cast<std::size_t>(pieces.degree_v()) + 1;
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const TrimEdge& edge = edges[e];
    if (!touched.empty() && touched[edge.piece] == 0) continue;
    double* curve = edge_curves.data() + e * length * components;
    for (std::size_t k = 0; k < components; ++k) {
      const double* c = pieces.coefficients(edge.piece) + k * pieces.component_size();
      std::vector<double> along_v;
      for (std::size_t a = 0; a < rows; ++a) {
        const std::vector<double> row =
            compose({c + a * columns, c + (a + 1) * columns}, columns, edge.from.y(), edge.to.y());
        along_v.insert(along_v.end(), row.begin(), row.end());
      }
      const std::vector<double> both = compose(std::move(along_v), rows, edge.from.x(), edge.to.x());
      std::copy(both.begin(), both.end(), curve + k * length);
    }
    Box3 box;
    for (std::size_t n = 0; n < length; ++n) {
      const double w = components == 4 ? curve[3 * length + n] : 1;
      box.include(Vec3(curve[n], curve[length + n], curve[2 * length + n]) / w);
    }
    edge_boxes[e] = box;
  }
  if (!edges.empty()) edge_tree.refit(edge_boxes);
  if (!tree.empty()) {
    const Box3& all = tree.nodes().front().box;
    centre = all.centre();
    size = (all.upper - all.lower).norm();
  }
}

}  // namespace detail

namespace {

/// Squares of larger coordinates would overflow.
constexpr double largest_coordinate = 1e100;
/// Questions a task of the parallel loop: some milliseconds.
constexpr std::size_t batch = 256;

bool usable(const Vec3& p) {
  return p.allFinite() && p.cwiseAbs().maxCoeff() <= largest_coordinate;
}

Error bad_place(const Vec3& p, std::string field) {
  return make_error(ErrorCode::invalid_argument,
                    fmt::format("found ({}, {}, {}), expected finite numbers up to {}", p.x(), p.y(), p.z(),
                                largest_coordinate),
                    std::move(field));
}

std::optional<Error> bad_ray(const Vec3& origin, const Vec3& direction, const std::string& index) {
  if (!usable(origin)) return bad_place(origin, "origins" + index);
  if (!usable(direction)) return bad_place(direction, "directions" + index);
  if (!(direction.cwiseAbs().maxCoeff() > 0)) {
    return make_error(ErrorCode::invalid_argument, "found no length, expected a direction",
                      "directions" + index);
  }
  return std::nullopt;
}

Vec3 unit(const Vec3& direction) {
  return (direction / direction.cwiseAbs().maxCoeff()).normalized();
}

}  // namespace

SurfaceProjector::SurfaceProjector(std::unique_ptr<detail::ProjectorData> data) : data_(std::move(data)) {}
SurfaceProjector::SurfaceProjector(SurfaceProjector&&) noexcept = default;
SurfaceProjector& SurfaceProjector::operator=(SurfaceProjector&&) noexcept = default;
SurfaceProjector::~SurfaceProjector() = default;

Result<SurfaceProjector> SurfaceProjector::create(const BSplineSurface& surface, std::vector<TrimLoop> loops,
                                                  const ProjectorOptions& options) {
  if (const Status status = check(surface); !status.ok()) return status.error();
  for (std::size_t n = 0; n < surface.control.size(); ++n) {
    if (!usable(surface.control[n])) return bad_place(surface.control[n], fmt::format("control[{}]", n));
  }
  Result<TrimRegion> region = TrimRegion::create(std::move(loops), {surface.u.lower(), surface.v.lower()},
                                                 {surface.u.upper(), surface.v.upper()});
  if (!region.ok()) return region.error();
  auto data = std::make_unique<detail::ProjectorData>(surface, *std::move(region), options);
  if (data->tree.empty()) {
    return make_error(ErrorCode::failed_precondition, "the loops enclose nothing of the surface", "loops");
  }
  return SurfaceProjector(std::move(data));
}

Result<ClosestOnSurface> SurfaceProjector::closest(const Vec3& place) const {
  if (!usable(place)) return bad_place(place, "place");
  return detail::find_closest(*data_, place, nullptr);
}

Result<ClosestOnSurface> SurfaceProjector::closest(const Vec3& place, const Vec2& seed) const {
  if (!usable(place)) return bad_place(place, "place");
  return detail::find_closest(*data_, place, &seed);
}

Status SurfaceProjector::closest(std::span<const Vec3> places, std::span<ClosestOnSurface> answers,
                                 const ParallelFor& parallel) const {
  if (places.size() != answers.size()) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected one a place ({})", answers.size(), places.size()),
                      "answers");
  }
  for (std::size_t n = 0; n < places.size(); ++n) {
    if (!usable(places[n])) return bad_place(places[n], fmt::format("places[{}]", n));
  }
  parallel((places.size() + batch - 1) / batch, [&](std::size_t task) {
    const std::size_t end = std::min(places.size(), (task + 1) * batch);
    for (std::size_t n = task * batch; n < end; ++n) {
      answers[n] = detail::find_closest(*data_, places[n], nullptr);
    }
  });
  return {};
}

Result<std::optional<SurfaceHit>> SurfaceProjector::ray(const Vec3& origin, const Vec3& direction) const {
  if (const std::optional<Error> error = bad_ray(origin, direction, "")) return *error;
  return detail::find_hit(*data_, origin, unit(direction));
}

Status SurfaceProjector::rays(std::span<const Vec3> origins, std::span<const Vec3> directions,
                              std::span<std::optional<SurfaceHit>> hits, const ParallelFor& parallel) const {
  if (origins.size() != hits.size() || directions.size() != hits.size()) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} origins, {} directions and room for {} hits, expected as many",
                                  origins.size(), directions.size(), hits.size()),
                      "origins");
  }
  for (std::size_t n = 0; n < origins.size(); ++n) {
    if (const auto error = bad_ray(origins[n], directions[n], fmt::format("[{}]", n))) return *error;
  }
  parallel((origins.size() + batch - 1) / batch, [&](std::size_t task) {
    const std::size_t end = std::min(origins.size(), (task + 1) * batch);
    for (std::size_t n = task * batch; n < end; ++n) {
      hits[n] = detail::find_hit(*data_, origins[n], unit(directions[n]));
    }
  });
  return {};
}

Status SurfaceProjector::refit(std::span<const Vec3> control) {
  if (control.size() != data_->control.size()) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} points, expected {}", control.size(), data_->control.size()),
                      "control");
  }
  std::vector<std::uint8_t> moved(control.size()), touched;
  for (std::size_t n = 0; n < control.size(); ++n) {
    if (!usable(control[n])) return bad_place(control[n], fmt::format("control[{}]", n));
    moved[n] = control[n] != data_->control[n];
  }
  data_->pieces.mark(moved, touched);
  std::copy(control.begin(), control.end(), data_->control.begin());
  data_->pieces.update(data_->control, touched);
  data_->refit(touched);
  return {};
}

std::size_t SurfaceProjector::piece_count() const {
  return data_->pieces.size();
}

}  // namespace handloft::geometry
