// The search for a ray's first hit (bspline_projection.h): the ray is where two planes meet, and a hit where
// the surface's signed distances to both vanish. Boxes are dropped by the signs of their Bernstein
// coefficients, also after a linear map that makes the two slopes nearly those of u and v, and finished by
// Newton's method where that map shows that they hold no more than one hit.

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "server-model/geometry/bernstein_field.h"
#include "server-model/geometry/projector_data.h"

namespace handloft::geometry::detail {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double distance_tolerance = 1e-12;  ///< Of the surface's size: hits may miss by this.
constexpr double rounding = 32 * std::numeric_limits<double>::epsilon();
constexpr double least_box = 0x1p-45;
constexpr double contracting = 0.9;  ///< Below 1: how far slopes may be from those of u and v.
constexpr int newton_steps = 30;

class RaySearch {
 public:
  RaySearch(const ProjectorData& data, const Vec3& origin, const Vec3& direction)
      : data_(data),
        pieces_(data.pieces),
        origin_(origin),
        direction_(direction),
        first_(direction.unitOrthogonal()),
        second_(direction.cross(first_)),
        tolerance_(distance_tolerance * data.size + rounding * ((origin - data.centre).norm() + data.size)),
        boxes_left_(data.options.max_boxes),
        rational_(data.pieces.is_rational()),
        rows_(static_cast<std::size_t>(data.pieces.degree_u()) + 1),
        columns_(static_cast<std::size_t>(data.pieces.degree_v()) + 1),
        size_(rows_ * columns_),
        field_(size_ * (rational_ ? 4 : 3)),
        children_(4 * field_),
        own_(field_),
        mapped_(2 * size_) {}

  std::optional<SurfaceHit> run() {
    walk();
    if (best_ == infinity) return std::nullopt;
    SurfaceHit hit;
    hit.uv = pieces_.parameters(best_piece_, best_at_.x(), best_at_.y());
    hit.place = best_place_;
    hit.distance_m = std::max(0.0, best_);
    return hit;
  }

 private:
  struct Box {
    Vec2 low = Vec2::Zero(), high = Vec2::Ones();
  };

  /// Where the ray enters a box that is larger by the tolerance; infinity where it misses.
  double entry(const Box3& box) const {
    double in = -tolerance_, out = best_;
    for (int k = 0; k < 3; ++k) {
      const double low = box.lower[k] - tolerance_ - origin_[k];
      const double high = box.upper[k] + tolerance_ - origin_[k];
      if (std::abs(direction_[k]) < 1e-300) {
        if (low > 0 || high < 0) return infinity;
        continue;
      }
      const double a = low / direction_[k], b = high / direction_[k];
      // An ulp or so more: the division rounds.
      in = std::max(in, std::min(a, b) - rounding * std::abs(std::min(a, b)));
      out = std::min(out, std::max(a, b) + rounding * std::abs(std::max(a, b)));
    }
    return in <= out ? in : infinity;
  }

  void walk() {
    if (data_.tree.empty()) return;
    const std::vector<BoxTree::Node>& nodes = data_.tree.nodes();
    std::array<std::pair<std::uint32_t, double>, 128> stack;
    std::size_t waiting = 0;
    stack[waiting++] = {0, entry(nodes[0].box)};
    while (waiting > 0) {
      std::pair<std::uint32_t, double> at = stack[--waiting];
      while (at.second < best_) {
        const BoxTree::Node& node = nodes[at.first];
        if (node.second == 0) {
          search_piece(node.item);
          break;
        }
        std::pair<std::uint32_t, double> near{at.first + 1, entry(nodes[at.first + 1].box)};
        std::pair<std::uint32_t, double> far{node.second, entry(nodes[node.second].box)};
        if (far.second < near.second) std::swap(near, far);
        if (far.second < best_) stack[waiting++] = far;
        at = near;
      }
    }
  }

  /// Distances to both planes, along the ray, and the weights, each size_ coefficients.
  void build_field(std::size_t piece) {
    const double* c = pieces_.coefficients(piece);
    if (pool_.size() < field_) pool_.resize(field_);
    for (std::size_t n = 0; n < size_; ++n) {
      const double w = rational_ ? c[3 * size_ + n] : 1;
      const Vec3 a = Vec3(c[n], c[size_ + n], c[2 * size_ + n]) - w * origin_;
      pool_[n] = first_.dot(a);
      pool_[size_ + n] = second_.dot(a);
      pool_[2 * size_ + n] = direction_.dot(a);
      if (rational_) pool_[3 * size_ + n] = w;
    }
  }

  struct Range {
    double least = infinity, most = -infinity;
    void see(double x) {
      least = std::min(least, x);
      most = std::max(most, x);
    }
  };
  /// Of a quotient: its coefficients' hull holds it.
  Range range(const double* field, std::size_t component) const {
    Range range;
    for (std::size_t n = 0; n < size_; ++n) {
      const double f = field[component * size_ + n];
      range.see(rational_ ? f / field[3 * size_ + n] : f);
    }
    return range;
  }

  void search_piece(std::size_t piece) {
    build_field(piece);
    stack_.assign(1, {});
    while (!stack_.empty()) {
      const Box box = stack_.back();
      stack_.pop_back();
      std::copy_n(pool_.begin() + static_cast<std::ptrdiff_t>(stack_.size() * field_), field_, own_.begin());
      const Range a = range(own_.data(), 0), b = range(own_.data(), 1), along = range(own_.data(), 2);
      if (a.least > tolerance_ || a.most < -tolerance_ || b.least > tolerance_ || b.most < -tolerance_)
        continue;
      if (along.most < -tolerance_ || along.least >= best_ || boxes_left_ == 0) continue;
      --boxes_left_;
      const bool within = std::max({-a.least, a.most, -b.least, b.most}) <= tolerance_;
      if (within || (box.high - box.low).x() < least_box) {
        offer(piece, (box.low + box.high) / 2);
        continue;
      }
      const Slopes slopes = map_slopes();
      if (slopes == Slopes::no_hit) continue;
      if (slopes == Slopes::one_at_most && newton(piece, box)) continue;
      push_children(box);
    }
  }

  enum class Slopes { no_hit, one_at_most, unclear };
  Slopes map_slopes() {
    // The slopes at the middle, from the corners' differences.
    const auto at = [&](std::size_t component, std::size_t a, std::size_t b) {
      return own_[component * size_ + a * columns_ + b];
    };
    Eigen::Matrix2d j;
    for (std::size_t k = 0; k < 2; ++k) {
      const auto row = static_cast<Eigen::Index>(k);
      const double f00 = at(k, 0, 0), f01 = at(k, 0, columns_ - 1), f10 = at(k, rows_ - 1, 0),
                   f11 = at(k, rows_ - 1, columns_ - 1);
      j(row, 0) = (f10 + f11 - f00 - f01) / 2;
      j(row, 1) = (f01 + f11 - f00 - f10) / 2;
    }
    const double determinant = j.determinant();
    if (!(std::abs(determinant) > 1e-8 * j.col(0).norm() * j.col(1).norm())) return Slopes::unclear;
    const Eigen::Matrix2d inverse = j.inverse();
    Range g, h;
    for (std::size_t n = 0; n < size_; ++n) {
      mapped_[n] = inverse(0, 0) * own_[n] + inverse(0, 1) * own_[size_ + n];
      mapped_[size_ + n] = inverse(1, 0) * own_[n] + inverse(1, 1) * own_[size_ + n];
      g.see(mapped_[n] / (rational_ ? own_[3 * size_ + n] : 1));
      h.see(mapped_[size_ + n] / (rational_ ? own_[3 * size_ + n] : 1));
    }
    const double slack_g = tolerance_ * inverse.row(0).norm() * 2;
    const double slack_h = tolerance_ * inverse.row(1).norm() * 2;
    if (g.least > slack_g || g.most < -slack_g || h.least > slack_h || h.most < -slack_h)
      return Slopes::no_hit;
    double worst = 0;
    for (std::size_t k = 0; k < 2; ++k) {
      double du = 0, dv = 0;
      const double* f = mapped_.data() + k * size_;
      const double nu = static_cast<double>(rows_ - 1), nv = static_cast<double>(columns_ - 1);
      for (std::size_t a = 0; a < rows_; ++a) {
        for (std::size_t b = 0; b < columns_; ++b) {
          const std::size_t n = a * columns_ + b;
          if (a + 1 < rows_) du = std::max(du, std::abs(nu * (f[n + columns_] - f[n]) - (k == 0 ? 1 : 0)));
          if (b + 1 < columns_) dv = std::max(dv, std::abs(nv * (f[n + 1] - f[n]) - (k == 1 ? 1 : 0)));
        }
      }
      worst = std::max(worst, du + dv);
    }
    return worst < contracting ? Slopes::one_at_most : Slopes::unclear;
  }

  /// True when it found the hit in a box.
  bool newton(std::size_t piece, const Box& box) {
    Vec2 at = (box.low + box.high) / 2;
    PieceDerivatives d;
    for (int step = 0; step < newton_steps; ++step) {
      pieces_.derivatives(piece, at.x(), at.y(), d);
      const Vec3 r = d.s - origin_;
      const Vec2 f(first_.dot(r), second_.dot(r));
      Eigen::Matrix2d j;
      j << first_.dot(d.su), first_.dot(d.sv), second_.dot(d.su), second_.dot(d.sv);
      const double determinant = j.determinant();
      if (!(std::abs(determinant) > 0)) return false;
      const Vec2 move = j.inverse() * f;
      const Vec2 next = (at - move).cwiseMax(box.low).cwiseMin(box.high);
      const double length = (next - at).cwiseAbs().maxCoeff();
      at = next;
      if (length < 1e-15) break;
    }
    pieces_.derivatives(piece, at.x(), at.y(), d);
    const Vec3 r = d.s - origin_;
    if (std::hypot(first_.dot(r), second_.dot(r)) > tolerance_) return false;
    offer(piece, at);
    return true;
  }

  void offer(std::size_t piece, const Vec2& at) {
    PieceDerivatives d;
    pieces_.derivatives(piece, at.x(), at.y(), d);
    const double along = direction_.dot(d.s - origin_);
    if (!(along < best_) || along < -tolerance_ || !data_.accepts(piece, at.x(), at.y())) return;
    best_ = along;
    best_piece_ = piece;
    best_at_ = at;
    best_place_ = d.s;
  }

  void push_children(const Box& box) {
    const std::size_t components = field_ / size_;
    const int nu = static_cast<int>(rows_) - 1, nv = static_cast<int>(columns_) - 1;
    for (std::size_t k = 0; k < components; ++k) {
      split_field(own_.data() + k * size_, nu, nv, Vec2(0.5, 0.5), children_.data() + k * 4 * size_);
    }
    const auto part = [&](std::size_t component, std::size_t child) {
      return children_.data() + (component * 4 + child) * size_;
    };
    std::array<std::pair<double, std::size_t>, 4> order;
    for (std::size_t c = 0; c < 4; ++c) {
      Range along;
      for (std::size_t n = 0; n < size_; ++n) along.see(part(2, c)[n] / (rational_ ? part(3, c)[n] : 1));
      order[c] = {along.least, c};
    }
    std::sort(order.begin(), order.end(), std::greater<>());
    const Vec2 middle = (box.low + box.high) / 2;
    for (const auto& [along, c] : order) {
      Box child = box;
      (c >= 2 ? child.low : child.high).x() = middle.x();
      ((c & 1U) != 0 ? child.low : child.high).y() = middle.y();
      const std::size_t slot = stack_.size() * field_;
      if (pool_.size() < slot + field_) pool_.resize(slot + field_);
      for (std::size_t k = 0; k < components; ++k) {
        std::copy_n(part(k, c), size_, pool_.begin() + static_cast<std::ptrdiff_t>(slot + k * size_));
      }
      stack_.push_back(child);
    }
  }

  const ProjectorData& data_;
  const BezierPieces& pieces_;
  Vec3 origin_, direction_, first_, second_;
  double tolerance_;
  std::size_t boxes_left_;
  bool rational_;
  std::size_t rows_, columns_, size_, field_;

  double best_ = infinity;
  std::size_t best_piece_ = 0;
  Vec2 best_at_ = Vec2::Zero();
  Vec3 best_place_ = Vec3::Zero();
  std::vector<Box> stack_;
  std::vector<double> pool_, children_, own_, mapped_;
};

}  // namespace

std::optional<SurfaceHit> find_hit(const ProjectorData& data, const Vec3& origin,
                                   const Vec3& unit_direction) {
  return RaySearch(data, origin, unit_direction).run();
}

}  // namespace handloft::geometry::detail
