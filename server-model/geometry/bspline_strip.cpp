#include "server-model/geometry/bspline_strip.h"

#include <algorithm>
#include <array>
#include <utility>

namespace handloft::geometry::detail {
namespace {

void append_point(const Vec3& point, double weight, bool rational, std::vector<double>& values) {
  const Vec3 scaled = weight * point;
  values.insert(values.end(), scaled.data(), scaled.data() + 3);
  if (rational) values.push_back(weight);
}

void append_from(const double* point, bool rational, std::vector<Vec3>& control,
                 std::vector<double>& weights) {
  const Vec3 scaled(point[0], point[1], point[2]);
  control.push_back(rational ? Vec3(scaled / point[3]) : scaled);
  if (rational) weights.push_back(point[3]);
}

}  // namespace

Strip to_strip(const BSplineCurve& curve) {
  const std::size_t width = curve.is_rational() ? 4 : 3;
  Strip strip{curve.knots, width, width, {}};
  strip.values.reserve(width * curve.control.size());
  for (std::size_t i = 0; i < curve.control.size(); ++i) {
    append_point(curve.control[i], curve.is_rational() ? curve.weights[i] : 1, curve.is_rational(),
                 strip.values);
  }
  return strip;
}

Strip to_strip(const BSplineSurface& surface, Direction direction) {
  const bool along_u = direction == Direction::u;
  const KnotVector& along = along_u ? surface.u : surface.v;
  const KnotVector& across = along_u ? surface.v : surface.u;
  const std::size_t point_width = surface.is_rational() ? 4 : 3;
  Strip strip{along, point_width * static_cast<std::size_t>(across.control_count()), point_width, {}};
  strip.values.reserve(point_width * surface.control.size());
  for (int i = 0; i < along.control_count(); ++i) {
    for (int j = 0; j < across.control_count(); ++j) {
      const std::size_t point = along_u ? surface.index(i, j) : surface.index(j, i);
      append_point(surface.control[point], surface.is_rational() ? surface.weights[point] : 1,
                   surface.is_rational(), strip.values);
    }
  }
  return strip;
}

BSplineCurve to_curve(Strip strip) {
  BSplineCurve curve{std::move(strip.knots), {}, {}};
  for (std::size_t at = 0; at < strip.values.size(); at += strip.point_width) {
    append_from(strip.values.data() + at, strip.point_width == 4, curve.control, curve.weights);
  }
  return curve;
}

BSplineSurface to_surface(const Strip& strip, Direction direction, const BSplineSurface& like) {
  const bool along_u = direction == Direction::u;
  BSplineSurface surface{along_u ? strip.knots : like.u, along_u ? like.v : strip.knots, {}, {}};
  const auto rows = static_cast<std::size_t>(surface.u.control_count());
  const auto columns = static_cast<std::size_t>(surface.v.control_count());
  surface.control.reserve(rows * columns);
  for (std::size_t i = 0; i < rows; ++i) {
    for (std::size_t j = 0; j < columns; ++j) {
      const std::size_t at =
          along_u ? i * strip.width + j * strip.point_width : j * strip.width + i * strip.point_width;
      append_from(strip.values.data() + at, strip.point_width == 4, surface.control, surface.weights);
    }
  }
  return surface;
}

double knot_image(const KnotVector& knots, double knot, long k) {
  if (k == 1 && knot == knots.lower()) return knots.upper();
  return k == 0 ? knot : knot + static_cast<double>(k) * knots.length();
}

double endless_knot(const KnotVector& knots, long index) {
  const long p = knots.degree();
  const long n = knots.control_count();
  long k = (index - p) / n;
  if ((index - p) % n < 0) --k;
  return knot_image(knots, knots.knots()[static_cast<std::size_t>(index - k * n)], k);
}

OpenStrip unroll(const Strip& strip, long first, long last) {
  OpenStrip open;
  open.degree = strip.knots.degree();
  open.width = strip.width;
  if (!strip.knots.is_periodic()) {
    open.knots = strip.knots.knots();
    open.values = strip.values;
    return open;
  }
  const long n = strip.knots.control_count();
  for (long i = first; i < last + open.degree + 1; ++i) open.knots.push_back(endless_knot(strip.knots, i));
  open.values.reserve(static_cast<std::size_t>(last - first) * strip.width);
  for (long i = first; i < last; ++i) {
    const auto row = strip.values.begin() + ((i % n + n) % n) * static_cast<long>(strip.width);
    open.values.insert(open.values.end(), row, row + static_cast<long>(strip.width));
  }
  return open;
}

OpenStrip insert(const OpenStrip& strip, std::span<const double> added) {
  if (added.empty()) return strip;
  // The NURBS Book, A5.4: from the right, each new knot blends p values of what stands right of it.
  const auto p = static_cast<std::size_t>(strip.degree);
  const std::size_t width = strip.width;
  const std::vector<double>& t = strip.knots;
  OpenStrip out;
  out.degree = strip.degree;
  out.width = width;
  out.knots.resize(t.size() + added.size());
  out.values.resize(strip.values.size() + added.size() * width);
  const auto span_of = [&](double x) {
    const auto low = t.begin() + static_cast<std::ptrdiff_t>(p);
    const auto high = t.end() - static_cast<std::ptrdiff_t>(p);
    const auto above =
        x >= *(high - 1) ? std::lower_bound(low, high, *(high - 1)) : std::upper_bound(low, high, x);
    return static_cast<std::size_t>(above - t.begin()) - 1;
  };
  const auto copy_row = [&](std::size_t from, std::size_t to) {
    std::copy_n(strip.values.begin() + static_cast<std::ptrdiff_t>(from * width), width,
                out.values.begin() + static_cast<std::ptrdiff_t>(to * width));
  };
  const std::size_t a = span_of(added.front());
  const std::size_t b = span_of(added.back()) + 1;
  const std::size_t more = added.size();
  for (std::size_t j = 0; j + p <= a; ++j) copy_row(j, j);
  for (std::size_t j = b - 1; j < strip.count(); ++j) copy_row(j, j + more);
  std::copy_n(t.begin(), a + 1, out.knots.begin());
  std::copy(t.begin() + static_cast<std::ptrdiff_t>(b + p), t.end(),
            out.knots.begin() + static_cast<std::ptrdiff_t>(b + p + more));
  std::size_t i = b + p - 1;
  std::size_t k = b + p + more - 1;
  for (std::size_t j = more; j-- > 0; --k) {
    for (; added[j] <= t[i] && i > a; --i, --k) {
      copy_row(i - p - 1, k - p - 1);
      out.knots[k] = t[i];
    }
    std::copy_n(out.values.begin() + static_cast<std::ptrdiff_t>((k - p) * width), width,
                out.values.begin() + static_cast<std::ptrdiff_t>((k - p - 1) * width));
    for (std::size_t l = 1; l <= p; ++l) {
      double* const left = out.values.data() + (k - p + l - 1) * width;
      const double* const right = left + width;
      const double gap = out.knots[k + l] - added[j];
      const double factor = gap == 0 ? 0 : gap / (out.knots[k + l] - t[i - p + l]);
      for (std::size_t m = 0; m < width; ++m) left[m] = factor * left[m] + (1 - factor) * right[m];
    }
    out.knots[k] = added[j];
  }
  return out;
}

OpenStrip interpolated(const OpenStrip& strip, std::span<const double> places) {
  std::vector<double> added;
  for (const double place : places) {
    const auto [first, last] = std::equal_range(strip.knots.begin(), strip.knots.end(), place);
    for (auto have = last - first; have < strip.degree; ++have) added.push_back(place);
  }
  return insert(strip, added);
}

OpenStrip segment(const OpenStrip& strip, double from, double to) {
  const auto p = static_cast<std::size_t>(strip.degree);
  const OpenStrip full = interpolated(strip, std::array{from, to});
  // The value whose p inner knots are all `from` lies on the shape, and so at `to`.
  const auto after = std::upper_bound(full.knots.begin(), full.knots.end(), from);
  const auto before = std::lower_bound(full.knots.begin(), full.knots.end(), to);
  const auto first = static_cast<std::size_t>(after - full.knots.begin()) - p - 1;
  const auto last = static_cast<std::size_t>(before - full.knots.begin()) - 1;
  OpenStrip part;
  part.degree = strip.degree;
  part.width = strip.width;
  part.knots.assign(p + 1, from);
  part.knots.insert(part.knots.end(), after, before);
  part.knots.insert(part.knots.end(), p + 1, to);
  part.values.assign(full.values.begin() + static_cast<std::ptrdiff_t>(first * full.width),
                     full.values.begin() + static_cast<std::ptrdiff_t>((last + 1) * full.width));
  return part;
}

Result<Strip> fold(const OpenStrip& raw, const Strip& like) {
  const auto p = static_cast<std::size_t>(raw.degree);
  const double lower = like.knots.lower();
  const double upper = like.knots.upper();
  // The domain starts at the last knot at `lower`: no function before it is felt inside. It ends at the first
  // at `upper`.
  const auto start = std::upper_bound(raw.knots.begin(), raw.knots.end(), lower) - raw.knots.begin() - 1;
  auto end = std::lower_bound(raw.knots.begin(), raw.knots.end(), upper) - raw.knots.begin();
  if (like.knots.is_periodic()) {
    // One period after `start`, with the same part of the seam's run.
    end = std::upper_bound(raw.knots.begin(), raw.knots.end(), upper) - raw.knots.begin() - 1;
  }
  const auto first = start - static_cast<std::ptrdiff_t>(p);
  const auto last = end + static_cast<std::ptrdiff_t>(p);  // Of the knots.
  if (first < 0 || last >= static_cast<std::ptrdiff_t>(raw.knots.size())) {
    return make_error(ErrorCode::internal, "the changed knots do not reach over the domain", "knots");
  }
  std::vector<double> knots(raw.knots.begin() + first, raw.knots.begin() + last + 1);
  Result<KnotVector> made = like.knots.is_periodic() ? KnotVector::periodic(raw.degree, std::move(knots))
                                                     : KnotVector::open(raw.degree, std::move(knots));
  if (!made) return made.error();
  const auto count = static_cast<std::size_t>(made->control_count());
  const auto from = static_cast<std::size_t>(first) * raw.width;
  return Strip{
      *std::move(made), raw.width, like.point_width,
      std::vector<double>(raw.values.begin() + static_cast<std::ptrdiff_t>(from),
                          raw.values.begin() + static_cast<std::ptrdiff_t>(from + count * raw.width))};
}

}  // namespace handloft::geometry::detail
