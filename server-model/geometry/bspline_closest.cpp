// The search for the closest point (bspline_projection.h).

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "server-model/geometry/bernstein_field.h"
#include "server-model/geometry/projector_data.h"

namespace handloft::geometry::detail {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double epsilon = std::numeric_limits<double>::epsilon();
/// Of the surface's size: nearer answers are not looked for.
constexpr double distance_tolerance = 1e-12;
/// What rounding adds to distances, in ulps of the largest.
constexpr double rounding = 32 * epsilon;
constexpr double least_box = 0x1p-40;  ///< Of a piece: below, halving no longer separates anything.
constexpr int newton_steps = 60;
constexpr double last_step = 1e-14;  ///< A step of Newton's method below this part of a piece is the last.
constexpr double in_basin = 1e-6;    ///< Steps below this converge quadratically and need no check.

struct Rectangle {
  Vec2 low = Vec2::Zero(), high = Vec2::Ones();
};

/// The least value of g.d + d.H d / 2 over a box around 0; H positive definite.
Vec2 least_in_box(double huu, double huv, double hvv, const Vec2& g, const Vec2& low, const Vec2& high) {
  const double determinant = huu * hvv - huv * huv;
  const Vec2 newton((huv * g.y() - hvv * g.x()) / determinant, (huv * g.x() - huu * g.y()) / determinant);
  if ((newton - low).minCoeff() >= 0 && (high - newton).minCoeff() >= 0) return newton;
  Vec2 best = Vec2::Zero();
  double best_value = 0;
  const auto offer = [&](const Vec2& d) {
    const double value = g.dot(d) + (huu * d.x() * d.x() + 2 * huv * d.x() * d.y() + hvv * d.y() * d.y()) / 2;
    if (value < best_value) best_value = value, best = d;
  };
  for (const double u : {low.x(), high.x()}) {
    offer({u, std::clamp(-(g.y() + huv * u) / hvv, low.y(), high.y())});
  }
  for (const double v : {low.y(), high.y()}) {
    offer({std::clamp(-(g.x() + huv * v) / huu, low.x(), high.x()), v});
  }
  return best;
}

/// A symmetric matrix of the same directions whose bends are those of H without their signs, and `lift` at
/// least: Newton's steps with it go downhill, as far as the bend says, at saddles and hilltops, too.
void make_definite(double& huu, double& huv, double& hvv, double lift) {
  const double mean = (huu + hvv) / 2, radius = std::hypot((huu - hvv) / 2, huv);
  const double high = std::max(std::abs(mean + radius), lift), low = std::max(std::abs(mean - radius), lift);
  const double part = radius > 0 ? (high - low) / (2 * radius) : 0;
  const double rest = (high + low) / 2 - part * mean;
  huu = rest + part * huu, huv *= part, hvv = rest + part * hvv;
}

class ClosestSearch {
 public:
  ClosestSearch(const ProjectorData& data, const Vec3& place)
      : data_(data),
        pieces_(data.pieces),
        place_(place),
        tolerance_(distance_tolerance * data.size + rounding * ((place - data.centre).norm() + data.size)),
        boxes_left_(data.options.max_boxes) {}

  ClosestOnSurface run(const Vec2* seed) {
    if (seed != nullptr) descend(*seed);
    if (!data_.edge_tree.empty()) begin_on_edge();
    // What loops cross comes last: there the nearest place may lie outside, and a good bound helps most.
    walk(data_.tree, [this](std::size_t piece) {
      if (data_.kinds[piece] == PieceKind::whole) {
        look_at_piece(piece);
      } else {
        crossed_.push_back(piece);
      }
    });
    walk(data_.edge_tree, [this](std::size_t edge) { look_at_edge(edge); });
    for (const std::size_t piece : crossed_) {
      if (!done()) look_at_piece(piece);
    }
    ClosestOnSurface answer;
    answer.uv = pieces_.parameters(best_piece_, best_at_.x(), best_at_.y());
    answer.place = best_place_;
    answer.distance_m = std::sqrt(best_);
    answer.gap_m = floor_ < limit_ ? answer.distance_m - std::sqrt(std::max(0.0, floor_)) : 0;
    return answer;
  }

 private:
  bool done() const { return best_ <= tolerance_ * tolerance_; }

  template <typename Visit>
  void walk(const BoxTree& tree, const Visit& visit) {
    if (tree.empty()) return;
    const std::vector<BoxTree::Node>& nodes = tree.nodes();
    struct Waiting {
      std::uint32_t node;
      double squared;
    };
    std::array<Waiting, 128> stack;  // One a level; trees of 2^32 items have fewer levels.
    std::size_t waiting = 0;
    stack[waiting++] = {0, nodes[0].box.squared_distance(place_)};
    while (waiting > 0) {
      Waiting at = stack[--waiting];
      for (;;) {
        if (at.squared >= limit_ || done()) break;
        const BoxTree::Node& node = nodes[at.node];
        if (node.second == 0) {
          visit(node.item);
          break;
        }
        Waiting first{at.node + 1, nodes[at.node + 1].box.squared_distance(place_)};
        Waiting second{node.second, nodes[node.second].box.squared_distance(place_)};
        if (second.squared < first.squared) std::swap(first, second);
        if (second.squared < limit_) stack[waiting++] = second;
        at = first;
      }
    }
  }

  void offer(std::size_t piece, const Vec2& at, const Vec3& place, double squared) {
    if (!(squared < best_)) return;
    if (data_.kinds[piece] != PieceKind::whole && !data_.accepts(piece, at.x(), at.y())) return;
    take(piece, at, place, squared);
  }
  void take(std::size_t piece, const Vec2& at, const Vec3& place, double squared) {
    if (!(squared < best_)) return;
    best_ = squared;
    best_piece_ = piece;
    best_at_ = at;
    best_place_ = place;
    const double nearer = std::max(0.0, std::sqrt(best_) - tolerance_);
    limit_ = nearer * nearer;
  }

  /// Any place of the region, so that there is a bound before the first piece is accepted.
  void begin_on_edge() {
    const std::vector<BoxTree::Node>& nodes = data_.edge_tree.nodes();
    std::uint32_t at = 0;
    while (nodes[at].second != 0) {
      const bool first =
          nodes[at + 1].box.squared_distance(place_) <= nodes[nodes[at].second].box.squared_distance(place_);
      at = first ? at + 1 : nodes[at].second;
    }
    const TrimEdge& edge = data_.edges[nodes[at].item];
    const Vec2 middle = (edge.from + edge.to) / 2;
    PieceDerivatives d;
    pieces_.derivatives(edge.piece, middle.x(), middle.y(), d);
    take(edge.piece, middle, d.s, (d.s - place_).squaredNorm());
  }

  /// From a seed to its local minimum, over the borders of pieces: where the search may begin.
  void descend(const Vec2& seed) {
    if (!seed.allFinite()) return;
    constexpr int most_hops = 16;
    Vec2 uv = seed;
    for (int hop = 0; hop < most_hops; ++hop) {
      Vec2 at;
      const std::size_t piece = pieces_.locate(uv, at.x(), at.y());
      if (data_.kinds[piece] == PieceKind::outside) return;
      const double before = best_;
      const Vec2 end = minimise_on_piece(piece, {}, at).at;
      if (!(best_ < before)) return;
      // On a border: go on in the piece beyond it.
      const auto columns = static_cast<std::size_t>(pieces_.columns());
      const std::size_t i = piece / columns, j = piece % columns;
      const auto beyond = [](const std::vector<double>& bounds, std::size_t n, double x, double here) {
        if (x == 0 && n > 0) return here - (bounds[n] - bounds[n - 1]) / 1024;
        if (x == 1 && n + 2 < bounds.size()) return here + (bounds[n + 2] - bounds[n + 1]) / 1024;
        return here;
      };
      const Vec2 there = pieces_.parameters(piece, end.x(), end.y());
      uv = {beyond(pieces_.u().bounds, i, end.x(), there.x()),
            beyond(pieces_.v().bounds, j, end.y(), there.y())};
      if (uv == there) return;
    }
  }

  void look_at_piece(std::size_t piece) {
    const PieceBound& bound = pieces_.bound(piece);
    const Vec3 from_centre = place_ - bound.centre;
    if (bound.squared_distance(place_) >= limit_) return;
    const bool convex = from_centre.norm() + bound.radius < bound.reach;
    if (!convex || !minimise_on_piece(piece, {}, Vec2(0.5, 0.5)).settled) search_piece(piece);
  }

  /// What Newton's method has found in a rectangle.
  struct Minimum {
    Vec2 at = Vec2::Zero();
    bool settled = false;  ///< Nothing near it is nearer. Else the steps were spent on the way.
  };

  /// The least squared distance over a rectangle by Newton's method from `start`, offered as an answer. Exact
  /// where the distance is convex; else a local minimum.
  Minimum minimise_on_piece(std::size_t piece, const Rectangle& box, const Vec2& start) {
    Minimum found{start, false};
    Vec2& at = found.at;
    PieceDerivatives d;
    pieces_.derivatives(piece, at.x(), at.y(), d);
    Vec3 r = d.s - place_;
    double value = r.squaredNorm();
    for (int step = 0; step < newton_steps && !found.settled; ++step) {
      const Vec2 move = newton_step(d, r, box.low - at, box.high - at);
      const double length = move.cwiseAbs().maxCoeff();
      found.settled = !(length > last_step);
      if (found.settled) break;
      double part = 1;
      bool nearer = false;
      for (int halving = 0; halving < 30 && !nearer; ++halving, part /= 2) {
        const Vec2 next = (at + part * move).cwiseMax(box.low).cwiseMin(box.high);
        PieceDerivatives e;
        pieces_.derivatives(piece, next.x(), next.y(), e);
        const Vec3 away = e.s - place_;
        const double squared = away.squaredNorm();
        nearer = squared < value || (length < in_basin && halving == 0);
        if (nearer) at = next, d = e, r = away, value = squared;
      }
      if (!nearer) break;
      found.settled = length < 1e-9;
    }
    offer(piece, at, d.s, value);
    return found;
  }

  /// Where the squared distance is least by its first and second derivatives, made convex, within low..high
  /// around 0. `r`: from the place to the surface.
  static Vec2 newton_step(const PieceDerivatives& d, const Vec3& r, const Vec2& low, const Vec2& high) {
    const Vec2 g(r.dot(d.su), r.dot(d.sv));
    const double guu = d.su.squaredNorm(), gvv = d.sv.squaredNorm();
    double huu = guu + r.dot(d.suu), huv = d.su.dot(d.sv) + r.dot(d.suv), hvv = gvv + r.dot(d.svv);
    const auto held = [&](int axis) { return g[axis] > 0 ? low[axis] >= 0 : g[axis] < 0 && high[axis] <= 0; };
    Vec2 move = Vec2::Zero();
    if (held(0) && held(1)) return move;
    if (held(0) || held(1)) {
      // Along a side of the box how it bends across says nothing.
      const int along = held(0) ? 1 : 0;
      const double metric = along == 0 ? guu : gvv, bend = std::abs(along == 0 ? huu : hvv);
      const double h = bend > 1e-10 * metric ? bend : metric;
      if (h > 0) move[along] = std::clamp(-g[along] / h, low[along], high[along]);
      return move;
    }
    if (!(huu > 0 && hvv > 0 && huu * hvv - huv * huv > 1e-10 * huu * hvv)) {
      const double lift = 1e-6 * (guu + gvv);
      if (!(lift > 0)) return move;
      make_definite(huu, huv, hvv, lift);
    }
    return least_in_box(huu, huv, hvv, g, low, high);
  }

  void look_at_edge(std::size_t edge) {
    const auto n = static_cast<int>(data_.edge_component()) - 1;
    if (!edge_weights_) edge_weights_.emplace(n);
    const ProductWeights none(0);
    build_field(data_.edge_curve(edge), n, 0, *edge_weights_, none);
    search_field(
        2 * n, 0, [&](const Rectangle& box) { return minimise_on_edge(edge, box); },
        [](const Rectangle&) { return false; });
  }

  Minimum minimise_on_edge(std::size_t number, const Rectangle& box) {
    const TrimEdge& edge = data_.edges[number];
    const Vec2 along = edge.to - edge.from;
    double x = (box.low.x() + box.high.x()) / 2;
    PieceDerivatives d;
    const auto at = [&](double y) { return Vec2(edge.from + y * along); };
    const auto squared_at = [&](double y) {
      pieces_.derivatives(edge.piece, at(y).x(), at(y).y(), d);
      return (d.s - place_).squaredNorm();
    };
    double value = squared_at(x);
    bool found = false;
    for (int step = 0; step < newton_steps && !found; ++step) {
      const Vec3 r = d.s - place_;
      const Vec3 c1 = along.x() * d.su + along.y() * d.sv;
      const Vec3 c2 =
          along.x() * along.x() * d.suu + 2 * along.x() * along.y() * d.suv + along.y() * along.y() * d.svv;
      const double g = r.dot(c1);
      double h = std::abs(c1.squaredNorm() + r.dot(c2));
      if (!(h > 1e-10 * c1.squaredNorm())) h = c1.squaredNorm();
      const double move = h > 0 ? std::clamp(x - g / h, box.low.x(), box.high.x()) - x : 0;
      found = !(std::abs(move) > last_step);
      if (found) break;
      double part = 1;
      bool nearer = false;
      const PieceDerivatives before = d;
      for (int halving = 0; halving < 30 && !nearer; ++halving, part /= 2) {
        const double squared = squared_at(x + part * move);
        nearer = squared < value || (std::abs(move) < in_basin && halving == 0);
        if (nearer) x += part * move, value = squared;
      }
      if (!nearer) {
        d = before;
        break;
      }
      found = std::abs(move) < 1e-9;
    }
    take(edge.piece, at(x), d.s, value);
    return {{x, 0.5}, found};
  }

  void search_piece(std::size_t piece) {
    if (!weights_u_) weights_u_.emplace(pieces_.degree_u()), weights_v_.emplace(pieces_.degree_v());
    build_field(pieces_.coefficients(piece), pieces_.degree_u(), pieces_.degree_v(), *weights_u_,
                *weights_v_);
    search_field(
        2 * pieces_.degree_u(), 2 * pieces_.degree_v(),
        [&](const Rectangle& box) { return minimise_on_piece(piece, box, (box.low + box.high) / 2); },
        [&](const Rectangle& box) { return data_.outside(piece, box.low, box.high); });
  }

  /// |A - w p|^2 and, when rational, w^2 as Bernstein polynomials of twice the degrees, at the bottom of the
  /// pool. Their quotient is the squared distance.
  void build_field(const double* c, int p, int q, const ProductWeights& wu, const ProductWeights& wv) {
    const auto rows = static_cast<std::size_t>(p) + 1, columns = static_cast<std::size_t>(q) + 1;
    const std::size_t component = rows * columns, wide = 2 * columns - 1, size = (2 * rows - 1) * wide;
    const bool rational = pieces_.is_rational();
    field_ = rational ? 2 * size : size;
    if (pool_.size() < field_) pool_.resize(field_);
    shifted_.resize(4 * component);
    for (std::size_t n = 0; n < component; ++n) {
      const double w = rational ? c[3 * component + n] : 1;
      for (int k = 0; k < 3; ++k) {
        const std::size_t at = static_cast<std::size_t>(k) * component + n;
        shifted_[4 * n + static_cast<std::size_t>(k)] = c[at] - w * place_[k];
      }
      shifted_[4 * n + 3] = w;
    }
    std::fill_n(pool_.begin(), field_, 0.0);
    for (std::size_t i = 0; i < rows; ++i) {
      for (std::size_t k = i; k < rows; ++k) {
        const double scale_u = (i == k ? 1 : 2) * wu(i, k);
        double* to = pool_.data() + (i + k) * wide;
        for (std::size_t j = 0; j < columns; ++j) {
          const double* x = shifted_.data() + 4 * (i * columns + j);
          for (std::size_t l = 0; l < columns; ++l) {
            const double* y = shifted_.data() + 4 * (k * columns + l);
            const double scale = scale_u * wv(j, l);
            to[j + l] += scale * (x[0] * y[0] + x[1] * y[1] + x[2] * y[2]);
            if (rational) to[size + j + l] += scale * (x[3] * y[3]);
          }
        }
      }
    }
  }

  struct Field {
    const double* n;
    const double* w;  ///< Null: 1 everywhere.
    std::size_t size;
    double quotient(std::size_t k) const { return w == nullptr ? n[k] : n[k] / w[k]; }
  };

  double least(const Field& field) const {
    double value = infinity;
    for (std::size_t k = 0; k < field.size; ++k) value = std::min(value, field.quotient(k));
    return value;
  }
  double most(const Field& field) const {
    double value = 0;
    for (std::size_t k = 0; k < field.size; ++k) value = std::max(value, field.quotient(k));
    return value;
  }

  /// n - level * w, whose sign tells on which side of `level` the quotient is.
  void at_level(const Field& field, double level) {
    level_.resize(field.size);
    for (std::size_t k = 0; k < field.size; ++k) {
      level_[k] = field.n[k] - (field.w == nullptr ? 0 : level * field.w[k]);
    }
  }

  /// What holds over a box for the squared distance where it is less than the best so far; and whether it has
  /// one minimum at all, since Newton's method may begin above the best. A rational distance is bounded
  /// through n - c w for the values c that it may have and that matter: linear in c, so the ends of their
  /// range decide.
  std::pair<FieldShape, bool> shape_below_best(const Field& field, double low, int nu, int nv) {
    const auto shape_at = [&](double level) {
      at_level(field, level);
      return shape_of(level_, nu, nv);
    };
    FieldShape below_best = shape_at(low);
    bool one = below_best.one_minimum();
    if (field.w == nullptr) return {below_best, one};
    const double high = most(field);
    if (one && best_ < high) {
      FieldShape everywhere = below_best;
      everywhere.meet(shape_at(high));
      one = everywhere.one_minimum();
    }
    below_best.meet(shape_at(std::min(best_, high)));
    return {below_best, one && below_best.one_minimum()};
  }

  /// The least of the field's corners, which are values of the squared distance.
  static double least_corner(const Field& field, int nu, int nv) {
    const auto last_row = static_cast<std::size_t>(nu) * static_cast<std::size_t>(nv + 1);
    const auto last = static_cast<std::size_t>(nv);
    return std::min(
        {field.quotient(0), field.quotient(last), field.quotient(last_row), field.quotient(last_row + last)});
  }

  /// Cuts the field at the bottom of the pool until every box is nearer nowhere, has one minimum, or the
  /// budget is spent. `minimise(rectangle)` offers the least value that Newton's method finds.
  template <typename Minimise, typename Skip>
  void search_field(int nu, int nv, const Minimise& minimise, const Skip& skip) {
    struct Waiting {
      Rectangle box;
      double least;
    };
    const std::size_t size = static_cast<std::size_t>(nu + 1) * static_cast<std::size_t>(nv + 1);
    const bool rational = pieces_.is_rational();
    const std::size_t children = nv > 0 ? 4 : 2;
    std::vector<Waiting> stack = {{{}, 0}};
    std::vector<double> halves(children * field_), own(field_);
    bool first = true;
    while (!stack.empty() && !done()) {
      const Waiting waiting = stack.back();
      stack.pop_back();
      const Rectangle& box = waiting.box;
      std::copy_n(pool_.begin() + static_cast<std::ptrdiff_t>(stack.size() * field_), field_, own.begin());
      const Field field{own.data(), rational ? own.data() + size : nullptr, size};
      const double low = least(field);
      if (low >= limit_ || skip(box)) continue;
      if (boxes_left_ == 0 || (box.high - box.low).x() < least_box) {
        floor_ = std::min(floor_, low);
        continue;
      }
      --boxes_left_;
      const auto [here, one] = shape_below_best(field, low, nu, nv);
      // It falls towards a side behind which the next box lies: nothing here is least.
      bool falls = false;
      for (int axis = 0; axis < 2; ++axis) {
        const int slope = here.slope[static_cast<std::size_t>(axis)];
        falls = falls || (slope > 0 && box.low[axis] > 0) || (slope < 0 && box.high[axis] < 1);
      }
      if (falls) continue;
      // Boxes that touch a valley (a cylinder seen from its axis) have no coefficient below it, those that
      // hold it do: the first cut goes through the minimum.
      Vec2 cut(0.5, 0.5);
      bool over = false;
      if (one || first || least_corner(field, nu, nv) < best_) {
        const Minimum found = minimise(box);
        if (first) cut = middling((found.at - box.low).cwiseQuotient(box.high - box.low));
        over = one && found.settled;
      }
      first = false;
      if (over || low >= limit_) continue;
      split_field(own.data(), nu, nv, cut, halves.data());
      if (rational) split_field(own.data() + size, nu, nv, cut, halves.data() + children * size);
      push_children(box, cut, size, children, halves, stack);
    }
  }

  /// Where to cut: not so near a side that nothing is gained.
  static Vec2 middling(const Vec2& cut) {
    constexpr double least_part = 1e-3;
    Vec2 result(0.5, 0.5);
    for (int axis = 0; axis < 2; ++axis) {
      if (cut[axis] > least_part && cut[axis] < 1 - least_part) result[axis] = cut[axis];
    }
    return result;
  }

  template <typename Stack>
  void push_children(const Rectangle& box, const Vec2& cut, std::size_t size, std::size_t children,
                     const std::vector<double>& halves, Stack& stack) {
    const bool rational = pieces_.is_rational();
    const Vec2 middle = box.low + cut.cwiseProduct(box.high - box.low);
    std::array<std::pair<double, std::size_t>, 4> order;
    for (std::size_t c = 0; c < children; ++c) {
      const Field field{halves.data() + c * size, rational ? halves.data() + (children + c) * size : nullptr,
                        size};
      order[c] = {least(field), c};
    }
    std::sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(children), std::greater<>());
    for (std::size_t k = 0; k < children; ++k) {
      const auto [low, c] = order[k];
      if (low >= limit_) continue;
      Rectangle part = box;
      const bool high_u = children == 4 ? c >= 2 : c == 1;
      (high_u ? part.low : part.high).x() = middle.x();
      if (children == 4) ((c & 1U) != 0 ? part.low : part.high).y() = middle.y();
      const std::size_t slot = stack.size() * field_;
      if (pool_.size() < slot + field_) pool_.resize(slot + field_);
      std::copy_n(halves.begin() + static_cast<std::ptrdiff_t>(c * size), size,
                  pool_.begin() + static_cast<std::ptrdiff_t>(slot));
      if (rational) {
        std::copy_n(halves.begin() + static_cast<std::ptrdiff_t>((children + c) * size), size,
                    pool_.begin() + static_cast<std::ptrdiff_t>(slot + size));
      }
      stack.push_back({part, low});
    }
  }

  const ProjectorData& data_;
  const BezierPieces& pieces_;
  Vec3 place_;
  double tolerance_;
  std::size_t boxes_left_;

  double best_ = infinity;   ///< Squared.
  double limit_ = infinity;  ///< (best - tolerance)^2: what is no nearer than this is of no interest.
  double floor_ = infinity;  ///< Squared: nothing that was left unseen is nearer.
  std::size_t best_piece_ = 0;
  Vec2 best_at_ = Vec2::Zero();
  Vec3 best_place_ = Vec3::Zero();

  std::vector<std::size_t> crossed_;

  std::size_t field_ = 0;     ///< Numbers a box.
  std::vector<double> pool_;  ///< Fields of the boxes that wait.
  std::vector<double> shifted_, level_;
  std::optional<ProductWeights> weights_u_, weights_v_, edge_weights_;
};

}  // namespace

ClosestOnSurface find_closest(const ProjectorData& data, const Vec3& place, const Vec2* seed) {
  return ClosestSearch(data, place).run(seed);
}

}  // namespace handloft::geometry::detail
