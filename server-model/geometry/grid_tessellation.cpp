#include "server-model/geometry/grid_tessellation.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include "server-model/geometry/span_bends.h"

namespace handloft::geometry {

namespace {

/// Below this part of the product of two tangents' lengths, their cross product says little of the normal.
constexpr double least_sine = 1e-12;
/// A task's rows, and how many control points a surface has at least for tasks to be worth while.
constexpr std::size_t task_rows = 32, parallel_points = 65'536;

std::vector<double> divided(const std::vector<double>& bounds, std::span<const int> parts) {
  std::vector<double> result;
  for (std::size_t k = 0; k + 1 < bounds.size(); ++k) {
    for (int n = 0; n < parts[k]; ++n) {
      result.push_back(bounds[k] + (bounds[k + 1] - bounds[k]) * n / parts[k]);
    }
  }
  result.push_back(bounds.back());
  return result;
}

std::vector<double> span_bounds(const KnotVector& knots) {
  std::vector<double> bounds;
  for (const int s : knots.spans()) bounds.push_back(knots.knots()[static_cast<std::size_t>(s)]);
  bounds.push_back(knots.upper());
  return bounds;
}

Status check_parameters(const std::vector<double>& values, const KnotVector& knots, const char* field) {
  const std::size_t least = knots.is_periodic() ? 4 : 2;  // A periodic one's last is its first.
  if (values.size() < least) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} values, expected {} or more", values.size(), least), field);
  }
  for (std::size_t k = 0; k < values.size(); ++k) {
    const bool ascends = k == 0 || values[k] > values[k - 1];
    if (!(values[k] >= knots.lower() && values[k] <= knots.upper() && ascends)) {
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found {}, expected ascending values in [{}, {}]", values[k],
                                    knots.lower(), knots.upper()),
                        fmt::format("{}[{}]", field, k));
    }
  }
  return {};
}

}  // namespace

GridParameters even_grid(const BSplineSurface& surface, int parts_per_span) {
  const auto grid = [&](const KnotVector& knots) {
    const std::vector<double> bounds = span_bounds(knots);
    return divided(bounds, std::vector<int>(bounds.size() - 1, std::max(1, parts_per_span)));
  };
  return {grid(surface.u), grid(surface.v)};
}

Result<GridParameters> grid_within(const BSplineSurface& surface, double chord_tolerance_m,
                                   std::size_t max_vertices) {
  if (const Status status = check(surface); !status.ok()) return status.error();
  if (!(chord_tolerance_m > 0 && std::isfinite(chord_tolerance_m))) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} m, expected above 0", chord_tolerance_m), "chord_tolerance_m");
  }
  const SpanBends bends(surface);
  const std::vector<double>&us = bends.us(), &vs = bends.vs();
  std::vector<int> parts_u(us.size() - 1, 1), parts_v(vs.size() - 1, 1);
  std::vector<double> need_u(us.size() - 1, 0), need_v(vs.size() - 1, 0);
  for (std::size_t i = 0; i + 1 < us.size(); ++i) {
    for (std::size_t j = 0; j + 1 < vs.size(); ++j) {
      const Vec2 shares = bends.shares({us[i], vs[j]}, {us[i + 1], vs[j + 1]});
      need_u[i] = std::max(need_u[i], shares.x());
      need_v[j] = std::max(need_v[j], shares.y());
    }
  }
  // Halving both sides quarters both shares; each direction may use half of the tolerance.
  const auto parts = [&](double need) {
    return std::max(1.0, std::ceil(std::sqrt(2 * need / chord_tolerance_m)));
  };
  double total_u = 1, total_v = 1;
  for (const double need : need_u) total_u += parts(need);
  for (const double need : need_v) total_v += parts(need);
  if (!(total_u * total_v <= static_cast<double>(max_vertices))) {
    return make_error(
        ErrorCode::resource_exhausted,
        fmt::format("{} x {} vertices needed, at most {} allowed", total_u, total_v, max_vertices),
        "chord_tolerance_m");
  }
  for (std::size_t i = 0; i < need_u.size(); ++i) parts_u[i] = static_cast<int>(parts(need_u[i]));
  for (std::size_t j = 0; j < need_v.size(); ++j) parts_v[j] = static_cast<int>(parts(need_v[j]));
  return GridParameters{divided(us, parts_u), divided(vs, parts_v)};
}

Result<GridTessellation> GridTessellation::create(const BSplineSurface& surface,
                                                  const GridParameters& parameters) {
  if (const Status status = check(surface); !status.ok()) return status.error();
  if (const Status status = check_parameters(parameters.us, surface.u, "us"); !status.ok())
    return status.error();
  if (const Status status = check_parameters(parameters.vs, surface.v, "vs"); !status.ok())
    return status.error();
  if (parameters.us.size() > max_vertices / parameters.vs.size()) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found {} x {} vertices, expected at most {}", parameters.us.size(),
                                  parameters.vs.size(), max_vertices),
                      "us");
  }
  GridTessellation grid(surface, tabulate(surface.u, parameters.us, 1),
                        tabulate(surface.v, parameters.vs, 1));
  grid.us_ = parameters.us;
  grid.vs_ = parameters.vs;
  const auto joined = [](const KnotVector& knots, const std::vector<double>& values) {
    const bool whole =
        knots.is_periodic() && values.front() == knots.lower() && values.back() == knots.upper();
    return values.size() - (whole ? 1 : 0);
  };
  grid.row_count_ = joined(surface.u, parameters.us);
  grid.column_count_ = joined(surface.v, parameters.vs);
  const std::size_t vertices = grid.row_count_ * grid.column_count_;
  grid.mesh_.positions.resize(vertices);
  grid.mesh_.normals.resize(vertices);
  grid.mesh_.opacity.assign(vertices, 1);
  grid.sums_.resize(static_cast<std::size_t>(surface.u.control_count()) * grid.column_count_);
  grid.make_triangles();
  if (const Status status = grid.update(surface.control); !status) return status.error();
  return grid;
}

GridTessellation::GridTessellation(const BSplineSurface& surface, BasisTable u, BasisTable v)
    : surface_(surface), u_(std::move(u)), v_(std::move(v)) {}

void GridTessellation::make_triangles() {
  const std::size_t rows = us_.size(), columns = vs_.size();
  mesh_.indices.reserve(6 * (rows - 1) * (columns - 1));
  const auto vertex = [&](std::size_t r, std::size_t c) {
    return static_cast<std::uint32_t>(r % row_count_ * column_count_ + c % column_count_);
  };
  for (std::size_t r = 0; r + 1 < rows; ++r) {
    for (std::size_t c = 0; c + 1 < columns; ++c) {
      const std::uint32_t a = vertex(r, c), b = vertex(r + 1, c), d = vertex(r + 1, c + 1),
                          e = vertex(r, c + 1);
      mesh_.indices.insert(mesh_.indices.end(), {a, b, d, a, d, e});
    }
  }
}

std::size_t GridTessellation::control_row(std::size_t row, std::size_t a) const {
  return static_cast<std::size_t>(surface_.u.control_of(u_.first_function[row] + static_cast<int>(a)));
}

std::size_t GridTessellation::control_column(std::size_t column, std::size_t b) const {
  return static_cast<std::size_t>(surface_.v.control_of(v_.first_function[column] + static_cast<int>(b)));
}

// Rows are taken and summed up in one go, while they are in the cache.
Status GridTessellation::update(std::span<const Vec3> control, const ParallelFor& parallel) {
  if (control.size() != surface_.control.size()) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} points, expected {}", control.size(), surface_.control.size()),
                      "control");
  }
  const auto rows = static_cast<std::size_t>(surface_.u.control_count());
  const auto columns = static_cast<std::size_t>(surface_.v.control_count());
  row_moved_.assign(rows, 0);
  sum_moved_.assign(rows * column_count_, 0);
  const std::size_t tasks = (rows + task_rows - 1) / task_rows;
  std::atomic<bool> finite = true;
  const auto take = [&](std::size_t task) {
    for (std::size_t i = task * task_rows; i < std::min(rows, (task + 1) * task_rows); ++i)
      if (!take_row(i, control.data() + i * columns)) finite = false;
  };
  if (control.size() < parallel_points) {
    run_in_turn(tasks, take);
  } else {
    parallel(tasks, take);
  }
  if (!finite) {
    is_stale_ = true;
    const auto bad =
        std::find_if(control.begin(), control.end(), [](const Vec3& point) { return !point.allFinite(); });
    return make_error(ErrorCode::invalid_argument, "found a number that is not finite",
                      fmt::format("control[{}]", bad - control.begin()));
  }
  is_stale_ = false;
  evaluate_rows(control.size() < parallel_points ? ParallelFor(run_in_turn) : parallel);
  return {};
}

bool GridTessellation::take_row(std::size_t row, const Vec3* control) {
  const auto columns = static_cast<std::size_t>(surface_.v.control_count());
  const std::span<const double> now(control->data(), 3 * columns);
  if (!Eigen::Map<const Eigen::ArrayXd>(now.data(), static_cast<Eigen::Index>(now.size())).allFinite())
    return false;
  Vec3* const before = surface_.control.data() + row * columns;
  const auto q = static_cast<std::size_t>(surface_.v.degree());
  std::vector<std::uint8_t> moved(columns);
  bool any = is_stale_, all = true;
  for (std::size_t n = 0; n < columns; ++n) {
    moved[n] = is_stale_ || control[n] != before[n];
    any = any || moved[n] != 0;
    all = all && moved[n] != 0;
  }
  if (!any) return true;
  std::copy(control, control + columns, before);
  row_moved_[row] = 1;
  for (std::size_t c = 0; c < column_count_; ++c) {
    bool sum_moved = all;
    for (std::size_t b = 0; b <= q && !sum_moved; ++b) sum_moved = moved[control_column(c, b)] != 0;
    if (!sum_moved) continue;
    sum_moved_[row * column_count_ + c] = 1;
    sum_along_v(row, c);
  }
  return true;
}

Status GridTessellation::update(std::span<const Vec3> rest, std::span<const Vec3> displacements) {
  if (rest.size() != displacements.size()) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("found {}, expected one a control point ({})", displacements.size(), rest.size()),
        "displacements");
  }
  std::vector<Vec3> control(rest.size());
  for (std::size_t n = 0; n < rest.size(); ++n) control[n] = rest[n] + displacements[n];
  return update(control);
}

void GridTessellation::evaluate_rows(const ParallelFor& parallel) {
  const auto p = static_cast<std::size_t>(surface_.u.degree());
  const std::size_t tasks = (row_count_ + task_rows - 1) / task_rows;
  std::vector<std::vector<std::uint32_t>> changed(tasks);
  parallel(tasks, [&](std::size_t task) {
    for (std::size_t r = task * task_rows; r < std::min(row_count_, (task + 1) * task_rows); ++r) {
      std::array<std::size_t, KnotVector::max_degree + 1> rows{};
      bool any = false;
      for (std::size_t a = 0; a <= p; ++a) {
        rows[a] = control_row(r, a);
        any = any || row_moved_[rows[a]] != 0;
      }
      if (!any) continue;
      for (std::size_t c = 0; c < column_count_; ++c) {
        bool moved = false;
        for (std::size_t a = 0; a <= p; ++a) moved = moved || sum_moved_[rows[a] * column_count_ + c] != 0;
        if (!moved) continue;
        sum_along_u(r, c, {rows.data(), p + 1});
        changed[task].push_back(static_cast<std::uint32_t>(r * column_count_ + c));
      }
    }
  });
  changed_.clear();
  for (const std::vector<std::uint32_t>& part : changed)
    changed_.insert(changed_.end(), part.begin(), part.end());
}

void GridTessellation::sum_along_v(std::size_t row, std::size_t column) {
  const std::span<const double> value = v_.at(column, 0), slope = v_.at(column, 1);
  const auto control_columns = static_cast<std::size_t>(surface_.v.control_count());
  Sum sum{};
  for (std::size_t b = 0; b < value.size(); ++b) {
    if (value[b] == 0 && slope[b] == 0) continue;  // At knots.
    const std::size_t n = row * control_columns + control_column(column, b);
    const Vec3& p = surface_.control[n];
    const double w = surface_.is_rational() ? surface_.weights[n] : 1;
    const Pair xy = {w * p.x(), w * p.y()}, zw = {w * p.z(), w};
    sum.xy += value[b] * xy;
    sum.zw += value[b] * zw;
    sum.slope_xy += slope[b] * xy;
    sum.slope_zw += slope[b] * zw;
  }
  sums_[row * column_count_ + column] = sum;
}

void GridTessellation::sum_along_u(std::size_t row, std::size_t column, std::span<const std::size_t> rows) {
  const std::span<const double> value = u_.at(row, 0), slope = u_.at(row, 1);
  Pair xy = {0, 0}, zw = xy, u_xy = xy, u_zw = xy, v_xy = xy, v_zw = xy;
  for (std::size_t a = 0; a < value.size(); ++a) {
    if (value[a] == 0 && slope[a] == 0) continue;
    const Sum& in = sums_[rows[a] * column_count_ + column];
    xy += value[a] * in.xy;
    zw += value[a] * in.zw;
    u_xy += slope[a] * in.xy;
    u_zw += slope[a] * in.zw;
    v_xy += value[a] * in.slope_xy;
    v_zw += value[a] * in.slope_zw;
  }
  Vec3 s(xy[0], xy[1], zw[0]), su(u_xy[0], u_xy[1], u_zw[0]), sv(v_xy[0], v_xy[1], v_zw[0]);
  if (surface_.is_rational()) {
    s /= zw[1];
    su = (su - u_zw[1] * s) / zw[1];
    sv = (sv - v_zw[1] * s) / zw[1];
  }
  const std::size_t vertex = row * column_count_ + column;
  mesh_.positions[vertex] = s;
  const Vec3 across = su.cross(sv);
  const double length = across.squaredNorm();
  const double least = least_sine * least_sine * su.squaredNorm() * sv.squaredNorm();
  mesh_.normals[vertex] =
      length > least ? Vec3(across / std::sqrt(length)) : surface_.normal(us_[row], vs_[column]);
}

}  // namespace handloft::geometry
