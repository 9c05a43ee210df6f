// Rings about a superellipse (A22, A23): the contours of its opacity, so that along a ring the opacity is the
// same and only between rings steps must be small. Outer rings have more vertices than inner ones.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "server-model/geometry/mesh_builder.h"

namespace handloft::geometry::detail {
namespace {

/// Places of a quadrant's rim among which vertices are chosen, evenly spaced along it. A power of two.
constexpr std::size_t rim_places = 1024;

/// Of the opacity tolerance, what the way outwards and the way around may use each; the rest is for triangles
/// that go both ways.
constexpr double tolerance_share = 0.4;

/// Largest -dT / d ln f of eq. 7: 0.6 f^6 exp(-f^6 / 10) at f^6 = 10, which is 6 / e.
constexpr double steepest_fade = 2.2072766470286540;

/// Directions in which the curvature is looked for on a ring.
constexpr std::size_t ring_samples = 32;

/// An inner ring keeps at least this many vertices a quadrant.
constexpr std::size_t fewest_around = 2;

class Rings {
 public:
  Rings(const PolynomialSurface& surface, const Superellipse& superellipse,
        const TessellationOptions& options)
      : surface_(surface),
        superellipse_(superellipse),
        options_(options),
        places_(superellipse.contour(visible_level(), static_cast<int>(rim_places))),
        fade_begin_(level_of_opacity(1 - tolerance_share * options.opacity_tolerance)) {
    for (const Vec2& p : places_) {
      reach_ = std::max(reach_, (p - superellipse.centre()).norm());
    }
    for (std::size_t i = 0; i < places_.size(); ++i) {
      rim_length_ += (places_[(i + 1) % places_.size()] - places_[i]).norm();
    }
    fractions_ = steps_outwards();
    double bend = bend_on(0);
    for (const double s : fractions_) bends_.push_back(bend = std::max(bend, bend_on(s)));
    choose_rim();
  }

  Result<TriangleMesh> mesh(const Frame& frame) const {
    MeshBuilder builder(surface_, frame);
    builder.reserve(1 + fractions_.size() * rim_.size(), 2 * fractions_.size() * rim_.size());
    builder.vertex(superellipse_.centre(), 1.0);
    std::vector<std::size_t> inner;
    std::size_t inner_begin = 0;
    std::size_t count = 1;
    for (std::size_t i = 0; i < fractions_.size(); ++i) {
      const double s = fractions_[i];
      const std::vector<std::size_t> outer = around(s, bends_[i]);
      const double opacity = opacity_at_level(visible_level() * std::pow(s, superellipse_.exponent()));
      for (const std::size_t k : outer) builder.vertex(at(s, k), opacity);
      if (inner.empty()) {
        for (std::size_t k = 0; k < outer.size(); ++k) {
          builder.triangle(0, count + k, count + (k + 1) % outer.size());
        }
      } else {
        stitch(inner, inner_begin, outer, count, builder);
      }
      inner = outer;
      inner_begin = count;
      count += outer.size();
    }
    return std::move(builder).finish();
  }

 private:
  Vec2 at(double s, std::size_t place) const {
    return superellipse_.centre() + s * (places_[place % places_.size()] - superellipse_.centre());
  }

  double bend_on(double s) const {
    double bend = 0;
    for (std::size_t k = 0; k < ring_samples; ++k) {
      bend = std::max(bend, bend_at(surface_, at(s, k * places_.size() / ring_samples)));
    }
    return bend;
  }

  /// Largest step of f over which a chord of T(s) stays within half of the opacity tolerance: the chord of a
  /// step h is off by |T_ss| h^2 / 8, where T_ss (ds/df)^2 = T_ff + T_f (n - 1) / (n f).
  double fade_step() const {
    const double n = superellipse_.exponent();
    double largest = 0;
    constexpr int samples = 64;
    for (int i = 1; i <= samples; ++i) {
      const double f = visible_level() * i / samples;
      const double t = opacity_at_level(f);
      const double f4 = f * f * f * f;
      const double slope = -0.6 * f4 * f * t;
      const double second = -3 * f4 * t + 0.36 * f4 * f4 * f * f * t;
      largest = std::max(largest, std::abs(second + slope * (n - 1) / (n * f)));
    }
    return std::sqrt(8 * tolerance_share * options_.opacity_tolerance / largest);
  }

  /// Fractions 0 < s <= 1 of the way from the centre to the rim: as the surface bends there, and finer where
  /// the opacity fades.
  std::vector<double> steps_outwards() const {
    const double rim = visible_level();
    const double n = superellipse_.exponent();
    const double fade = fade_step();
    const double longest = 1.0 / options_.min_divisions;
    const double shortest = 1.0 / options_.max_divisions;
    std::vector<double> rings;
    double s = 0;
    while (s < 1) {
      // Half of the chord tolerance; the other half is for the way around.
      const auto step_for = [&](double bend) {
        const double step = std::sqrt(4 * options_.chord_tolerance_m / bend) / reach_;
        return step >= shortest ? std::min(step, longest) : shortest;  // Also for NaN.
      };
      double step = step_for(bend_on(s));
      step = std::min(step, step_for(bend_on(std::min(s + step, 1.0))));
      const double limit = std::max(rim * std::pow(s, n) + fade, fade_begin_);
      double next = std::min(s + step, std::pow(std::min(limit / rim, 1.0), 1 / n));
      if (next > 1 - 0.1 * (next - s)) next = 1;  // No sliver at the rim.
      rings.push_back(next);
      s = next;
    }
    return rings;
  }

  /// How much the piece between two places of the rim wants to be divided, scaled to the ring s: above 1
  /// where its chord is off by more than half of a tolerance, or longer than the fewest divisions allow.
  double need(std::size_t begin, std::size_t end, double s, double bend) const {
    const Vec2 a = at(1, begin);
    const Vec2 b = at(1, end);
    const double length = s * (b - a).norm();
    const double even = 4 * options_.min_divisions * length / rim_length_;
    const double bending = length * length * bend / (4 * options_.chord_tolerance_m);
    double fading = 0;
    if (visible_level() * std::pow(s, superellipse_.exponent()) >= fade_begin_) {
      for (const double t : {0.25, 0.5, 0.75}) {
        const double level = superellipse_.level(a + t * (b - a)) / visible_level();
        fading = std::max(
            fading, steepest_fade * std::abs(1 - level) / (tolerance_share * options_.opacity_tolerance));
      }
    }
    return std::max({even, std::min(bending, 1e300), fading});
  }

  /// The rim's vertices: the neediest piece is halved until none needs it or there are enough.
  void choose_rim() {
    for (std::size_t quadrant = 0; quadrant < 4; ++quadrant) {
      const std::size_t first = quadrant * rim_places;
      std::vector<std::size_t> chosen{first, first + rim_places};
      std::vector<double> needs{need(chosen[0], chosen[1], 1, bends_.back())};
      while (needs.size() < static_cast<std::size_t>(options_.max_divisions)) {
        const auto neediest = std::max_element(needs.begin(), needs.end());
        if (!(*neediest > 1)) break;
        const auto i = static_cast<std::size_t>(neediest - needs.begin());
        if (chosen[i + 1] - chosen[i] < 2) {
          *neediest = 0;
          continue;
        }
        const std::size_t middle = (chosen[i] + chosen[i + 1]) / 2;
        chosen.insert(chosen.begin() + static_cast<std::ptrdiff_t>(i) + 1, middle);
        needs[i] = need(chosen[i], middle, 1, bends_.back());
        needs.insert(needs.begin() + static_cast<std::ptrdiff_t>(i) + 1,
                     need(middle, chosen[i + 2], 1, bends_.back()));
      }
      rim_.insert(rim_.end(), chosen.begin(), chosen.end() - 1);
    }
  }

  /// The vertices of the ring s: of the rim's those that it needs. Not fewer than the rim's for stars, where
  /// a coarser ring would cross a finer one.
  std::vector<std::size_t> around(double s, double bend) const {
    if (superellipse_.exponent() < 1) return rim_;
    std::vector<std::size_t> ring;
    for (std::size_t quadrant = 0; quadrant < 4; ++quadrant) {
      collect(quadrant * rim_places, (quadrant + 1) * rim_places, s, bend, ring);
    }
    return ring;
  }
  void collect(std::size_t begin, std::size_t end, double s, double bend,
               std::vector<std::size_t>& ring) const {
    // Pieces are halves of halves: what is chosen between begin and end hangs together by its middle.
    const std::size_t middle = (begin + end) / 2;
    const bool divided = end - begin >= 2 && std::binary_search(rim_.begin(), rim_.end(), middle);
    if (divided && (need(begin, end, s, bend) > 1 || end - begin > rim_places / fewest_around)) {
      collect(begin, middle, s, bend, ring);
      collect(middle, end, s, bend, ring);
    } else {
      ring.push_back(begin);
    }
  }

  /// Triangles between two rings, of which the inner one has some of the outer one's vertices.
  static void stitch(const std::vector<std::size_t>& inner, std::size_t inner_begin,
                     const std::vector<std::size_t>& outer, std::size_t outer_begin, MeshBuilder& builder) {
    std::size_t at = 0;
    for (std::size_t k = 0; k < inner.size(); ++k) {
      const std::size_t a = inner_begin + k;
      const std::size_t b = inner_begin + (k + 1) % inner.size();
      std::size_t end = at + 1;
      while (end < outer.size() && (k + 1 == inner.size() || outer[end] < inner[k + 1])) ++end;
      // A fan of the first half about a, of the second half about b.
      const std::size_t half = at + (end - at + 1) / 2;
      const auto outer_at = [&](std::size_t i) { return outer_begin + i % outer.size(); };
      for (std::size_t i = at; i < half; ++i) builder.triangle(a, outer_at(i), outer_at(i + 1));
      builder.triangle(a, outer_at(half), b);
      for (std::size_t i = half; i < end; ++i) builder.triangle(b, outer_at(i), outer_at(i + 1));
      at = end;
    }
  }

  const PolynomialSurface& surface_;
  const Superellipse& superellipse_;
  const TessellationOptions& options_;
  std::vector<Vec2> places_;
  double fade_begin_;  ///< Inside, the opacity is so near 1 that rings need not follow its contours.
  double reach_ = 0;
  double rim_length_ = 0;
  std::vector<double> fractions_;  ///< Of the rings.
  std::vector<double> bends_;      ///< Largest second derivative of the heights up to each of them.
  std::vector<std::size_t> rim_;   ///< Ascending indices of places.
};

}  // namespace

Result<TriangleMesh> tessellate_rings(const PolynomialSurface& surface, const Frame& frame,
                                      const Superellipse& superellipse, const TessellationOptions& options) {
  return Rings(surface, superellipse, options).mesh(frame);
}

}  // namespace handloft::geometry::detail
