#include "server-model/model/bspline_message.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "server-model/model/validate.h"

namespace handloft::model {

namespace v1 = handloft::v1;
using geometry::KnotVector;
using geometry::Vec2;
using geometry::Vec3;

namespace {

Error below(Error error, const std::string& field) {
  error.field = field;
  return error;
}

Error count_error(std::size_t found, std::string_view what, std::size_t expected, const std::string& field) {
  return make_error(ErrorCode::invalid_argument,
                    fmt::format("found {} {}, expected {}", found, what, expected), field);
}

template <typename Numbers>
std::vector<double> to_vector(const Numbers& numbers) {
  return {numbers.begin(), numbers.end()};
}

Result<KnotVector> read_knots(std::uint32_t degree, bool periodic,
                              const google::protobuf::RepeatedField<double>& knots,
                              const std::string& field) {
  if (degree > static_cast<std::uint32_t>(KnotVector::max_degree)) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found degree {}, expected 1..{}", degree, KnotVector::max_degree), field);
  }
  auto made = periodic ? KnotVector::periodic(static_cast<int>(degree), to_vector(knots))
                       : KnotVector::open(static_cast<int>(degree), to_vector(knots));
  if (!made) return below(made.error(), field);
  return made;
}

/// Checks and copies weights; `count` is how many control points there are.
Result<std::vector<double>> read_weights(const google::protobuf::RepeatedField<double>& weights,
                                         std::size_t count, const std::string& field) {
  if (!weights.empty() && static_cast<std::size_t>(weights.size()) != count) {
    return count_error(static_cast<std::size_t>(weights.size()), "weights", count, field);
  }
  for (int i = 0; i < weights.size(); ++i) {
    if (!(weights[i] > 0 && std::isfinite(weights[i]))) {
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found {}, expected a finite number above 0", weights[i]),
                        fmt::format("{}[{}]", field, i));
    }
  }
  return to_vector(weights);
}

}  // namespace

Result<geometry::BSplineSurface> read_surface(const v1::BSplineSurface& message, const std::string& field,
                                              const Limits& limits) {
  auto u = read_knots(message.degree_u(), message.periodic_u(), message.knots_u(), field + ".knots_u");
  if (!u) return u.error();
  auto v = read_knots(message.degree_v(), message.periodic_v(), message.knots_v(), field + ".knots_v");
  if (!v) return v.error();
  const auto count =
      static_cast<std::size_t>(u->control_count()) * static_cast<std::size_t>(v->control_count());
  if (count > limits.max_control_points) {
    return make_error(
        ErrorCode::resource_exhausted,
        fmt::format("found {} control points, expected at most {}", count, limits.max_control_points),
        field + ".control");
  }
  if (static_cast<std::size_t>(message.control_size()) != 3 * count) {
    return count_error(static_cast<std::size_t>(message.control_size()), "coordinates of control points",
                       3 * count, field + ".control");
  }
  auto weights = read_weights(message.weights(), count, field + ".weights");
  if (!weights) return weights.error();
  geometry::BSplineSurface surface{std::move(*u), std::move(*v), {}, std::move(*weights)};
  surface.control.resize(count);
  for (std::size_t i = 0; i < 3 * count; ++i) {
    const double value = message.control(static_cast<int>(i));
    // The path is only spelled out for a bad one.
    if (!(std::abs(value) <= limits.max_coordinate_m)) {
      return check_coordinate(value, fmt::format("{}.control[{}]", field, i), limits).error();
    }
    surface.control[i / 3][static_cast<Eigen::Index>(i % 3)] = value;
  }
  return surface;
}

void write_surface(const geometry::BSplineSurface& surface, v1::BSplineSurface& message) {
  message.set_degree_u(static_cast<std::uint32_t>(surface.u.degree()));
  message.set_degree_v(static_cast<std::uint32_t>(surface.v.degree()));
  message.set_periodic_u(surface.u.is_periodic());
  message.set_periodic_v(surface.v.is_periodic());
  message.mutable_knots_u()->Assign(surface.u.knots().begin(), surface.u.knots().end());
  message.mutable_knots_v()->Assign(surface.v.knots().begin(), surface.v.knots().end());
  message.clear_control();
  message.mutable_control()->Reserve(static_cast<int>(3 * surface.control.size()));
  for (const Vec3& point : surface.control) {
    for (const double coordinate : point) message.add_control(coordinate);
  }
  message.mutable_weights()->Assign(surface.weights.begin(), surface.weights.end());
}

Result<FaceTrim> read_trim(const google::protobuf::RepeatedPtrField<v1::TrimLoop>& loops,
                           const std::string& field, const Limits& limits) {
  FaceTrim trim;
  std::size_t curves = 0;
  for (const v1::TrimLoop& loop : loops) {
    const std::string loop_field = fmt::format("{}[{}]", field, trim.size());
    curves += static_cast<std::size_t>(loop.curves_size());
    if (loop.curves().empty()) {
      return make_error(ErrorCode::invalid_argument, "found no curve, expected at least one",
                        loop_field + ".curves");
    }
    if (curves > limits.max_trim_curves) {
      return make_error(ErrorCode::resource_exhausted,
                        fmt::format("found more than {} curves", limits.max_trim_curves), field);
    }
    std::vector<TrimSpline>& splines = trim.emplace_back();
    for (const v1::BSplineCurve2& curve : loop.curves()) {
      const std::string curve_field = fmt::format("{}.curves[{}]", loop_field, splines.size());
      auto knots = read_knots(curve.degree(), false, curve.knots(), curve_field + ".knots");
      if (!knots) return knots.error();
      const auto count = static_cast<std::size_t>(knots->control_count());
      if (static_cast<std::size_t>(curve.control_size()) != 2 * count) {
        return count_error(static_cast<std::size_t>(curve.control_size()), "coordinates of control points",
                           2 * count, curve_field + ".control");
      }
      auto weights = read_weights(curve.weights(), count, curve_field + ".weights");
      if (!weights) return weights.error();
      TrimSpline spline{std::move(*knots), std::vector<Vec2>(count), std::move(*weights)};
      for (std::size_t i = 0; i < 2 * count; ++i) {
        const double value = curve.control(static_cast<int>(i));
        if (!std::isfinite(value)) {
          return make_error(ErrorCode::invalid_argument,
                            fmt::format("found {}, expected a finite number", value),
                            fmt::format("{}.control[{}]", curve_field, i));
        }
        spline.control[i / 2][static_cast<Eigen::Index>(i % 2)] = value;
      }
      splines.push_back(std::move(spline));
    }
  }
  return trim;
}

void write_trim(const FaceTrim& trim, google::protobuf::RepeatedPtrField<v1::TrimLoop>& loops) {
  for (const std::vector<TrimSpline>& splines : trim) {
    v1::TrimLoop& loop = *loops.Add();
    for (const TrimSpline& spline : splines) {
      v1::BSplineCurve2& curve = *loop.add_curves();
      curve.set_degree(static_cast<std::uint32_t>(spline.knots.degree()));
      curve.mutable_knots()->Assign(spline.knots.knots().begin(), spline.knots.knots().end());
      for (const Vec2& point : spline.control) {
        curve.add_control(point.x());
        curve.add_control(point.y());
      }
      curve.mutable_weights()->Assign(spline.weights.begin(), spline.weights.end());
    }
  }
}

}  // namespace handloft::model
