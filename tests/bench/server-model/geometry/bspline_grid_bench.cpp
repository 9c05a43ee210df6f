// A B-spline surface at the places of a grid: the evaluation in each frame of a drag. The largest surface of
// the paper, 159 x 81 control points, at 24,300 places (its 48,536 triangles) must take <= 1 ms on one core.
// Baselines in the same run: OCCT place by place, with and without its span cache, and de Boor's algorithm.

#include <benchmark/benchmark.h>

#include <GeomAdaptor_Surface.hxx>
#include <Geom_BSplineSurface.hxx>
#include <TColStd_Array1OfInteger.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <TColgp_Array2OfPnt.hxx>
#include <cmath>
#include <vector>

#include "server-model/geometry/bspline_grid.h"
#include "server-model/geometry/bspline_surface.h"

namespace handloft::geometry {
namespace {

enum class Weights { none, some };

BSplineSurface hood(int rows, int columns, Weights weights) {
  BSplineSurface surface{
      KnotVector::uniform(3, rows).value(), KnotVector::uniform(3, columns).value(), {}, {}};
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) {
      surface.control.emplace_back(0.01 * i, 0.01 * j, 0.1 * std::sin(0.04 * i) * std::cos(0.05 * j));
      if (weights == Weights::some) surface.weights.push_back(1 + 0.1 * std::sin(i + j));
    }
  }
  return surface;
}

std::vector<double> spread(std::size_t count) {
  std::vector<double> parameters;
  for (std::size_t i = 0; i < count; ++i) {
    parameters.push_back(static_cast<double>(i) / static_cast<double>(count - 1));
  }
  return parameters;
}

/// The paper's polygon counts are two triangles a cell: 180 x 135 places.
constexpr std::size_t place_rows = 180, place_columns = 135;

struct Case {
  explicit Case(Weights weights = Weights::none) : surface(hood(159, 81, weights)) {}
  BSplineSurface surface;
  std::vector<double> us = spread(place_rows), vs = spread(place_columns);
};

void count(benchmark::State& state) {
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(place_rows * place_columns));
}

void evaluate_grid_once(benchmark::State& state) {
  const Case c;
  std::vector<Vec3> places;
  for (auto _ : state) {
    evaluate_grid(c.surface, c.us, c.vs, places);
    benchmark::DoNotOptimize(places.data());
  }
  count(state);
}
BENCHMARK(evaluate_grid_once)->Unit(benchmark::kMicrosecond);

void grid_places(benchmark::State& state) {
  const Case c(state.range(0) == 0 ? Weights::none : Weights::some);
  const GridEvaluator grid(c.surface, c.us, c.vs);
  std::vector<Vec3> places;
  for (auto _ : state) {
    if (!grid.evaluate(c.surface, places)) state.SkipWithError("refused");
    benchmark::DoNotOptimize(places.data());
  }
  count(state);
}
BENCHMARK(grid_places)->ArgName("rational")->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);

void grid_places_and_normals(benchmark::State& state) {
  const Case c(state.range(0) == 0 ? Weights::none : Weights::some);
  const GridEvaluator grid(c.surface, c.us, c.vs);
  std::vector<Vec3> places, normals;
  for (auto _ : state) {
    if (!grid.evaluate(c.surface, places, normals)) state.SkipWithError("refused");
    benchmark::DoNotOptimize(normals.data());
  }
  count(state);
}
BENCHMARK(grid_places_and_normals)->ArgName("rational")->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);

void grid_scalar_field(benchmark::State& state) {
  const Case c;
  const GridEvaluator grid(c.surface, c.us, c.vs);
  std::vector<double> field, values(grid.size());
  for (const Vec3& p : c.surface.control) field.push_back(p.z());
  for (auto _ : state) {
    if (!grid.evaluate(field, 1, values)) state.SkipWithError("refused");
    benchmark::DoNotOptimize(values.data());
  }
  count(state);
}
BENCHMARK(grid_scalar_field)->Unit(benchmark::kMicrosecond);

void place_by_place(benchmark::State& state) {
  const Case c;
  for (auto _ : state) {
    for (const double u : c.us) {
      for (const double v : c.vs) benchmark::DoNotOptimize(c.surface.evaluate(u, v));
    }
  }
  count(state);
}
BENCHMARK(place_by_place)->Unit(benchmark::kMicrosecond);

Handle(Geom_BSplineSurface) to_occt(const BSplineSurface& surface) {
  TColgp_Array2OfPnt poles(1, surface.u.control_count(), 1, surface.v.control_count());
  for (int i = 0; i < surface.u.control_count(); ++i) {
    for (int j = 0; j < surface.v.control_count(); ++j) {
      const Vec3& p = surface.at(i, j);
      poles.SetValue(i + 1, j + 1, gp_Pnt(p.x(), p.y(), p.z()));
    }
  }
  const auto distinct = [](const KnotVector& knots) {
    const int n = static_cast<int>(knots.spans().size()) + 1;
    TColStd_Array1OfReal values(1, n);
    for (int i = 1; i < n; ++i) {
      values.SetValue(
          i, knots.knots()[static_cast<std::size_t>(knots.spans()[static_cast<std::size_t>(i - 1)])]);
    }
    values.SetValue(n, knots.upper());
    return values;
  };
  const auto times = [](const KnotVector& knots) {
    const int n = static_cast<int>(knots.spans().size()) + 1;
    TColStd_Array1OfInteger values(1, n);
    values.Init(1);
    values.SetValue(1, knots.degree() + 1);
    values.SetValue(n, knots.degree() + 1);
    return values;
  };
  return new Geom_BSplineSurface(poles, distinct(surface.u), distinct(surface.v), times(surface.u),
                                 times(surface.v), 3, 3);
}

void occt_surface_d0(benchmark::State& state) {
  const Case c;
  const Handle(Geom_BSplineSurface) surface = to_occt(c.surface);
  gp_Pnt place;
  for (auto _ : state) {
    for (const double u : c.us) {
      for (const double v : c.vs) {
        surface->D0(u, v, place);
        benchmark::DoNotOptimize(place);
      }
    }
  }
  count(state);
}
BENCHMARK(occt_surface_d0)->Unit(benchmark::kMicrosecond);

void occt_adaptor_d0(benchmark::State& state) {
  const Case c;
  const GeomAdaptor_Surface surface(to_occt(c.surface));
  gp_Pnt place;
  for (auto _ : state) {
    for (const double u : c.us) {
      for (const double v : c.vs) {
        surface.D0(u, v, place);
        benchmark::DoNotOptimize(place);
      }
    }
  }
  count(state);
}
BENCHMARK(occt_adaptor_d0)->Unit(benchmark::kMicrosecond);

/// As the textbook has it: rows by corner cutting, then the column.
Vec3 de_boor(const KnotVector& knots, double u, std::vector<Vec3>& d) {
  const auto p = static_cast<std::size_t>(knots.degree());
  const auto s = static_cast<std::size_t>(knots.span(u));
  const std::vector<double>& t = knots.knots();
  for (std::size_t r = 1; r <= p; ++r) {
    for (std::size_t j = p; j >= r; --j) {
      const double a = (u - t[s - p + j]) / (t[s + 1 + j - r] - t[s - p + j]);
      d[j] = (1 - a) * d[j - 1] + a * d[j];
    }
  }
  return d[p];
}

void naive_de_boor(benchmark::State& state) {
  const Case c;
  std::vector<Vec3> column(4), row(4);
  for (auto _ : state) {
    for (const double u : c.us) {
      const int i0 = c.surface.u.span(u) - 3;
      for (const double v : c.vs) {
        const int j0 = c.surface.v.span(v) - 3;
        for (int i = 0; i < 4; ++i) {
          for (int j = 0; j < 4; ++j) row[static_cast<std::size_t>(j)] = c.surface.at(i0 + i, j0 + j);
          column[static_cast<std::size_t>(i)] = de_boor(c.surface.v, v, row);
        }
        benchmark::DoNotOptimize(de_boor(c.surface.u, u, column));
      }
    }
  }
  count(state);
}
BENCHMARK(naive_de_boor)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace handloft::geometry
