#include "server-model/geometry/propagation.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <memory>

#include "server-model/geometry/gauss_grid.h"
#include "server-model/geometry/pair_sums.h"

namespace handloft::geometry {

namespace {

// Of one pair's kernel, which lies in 0..1; see the header. The smooth falloff's mean divides by as little as
// 0.027.
constexpr double literal_tolerance = 1e-8;
constexpr double smooth_tolerance = 4e-9;
// For the smooth falloff, grids only where d^2 < 0.92 R^2, so eta > 0.027.
constexpr double smooth_grid_limit = 0.92;
// Boxes are compared with the range with this much doubt, so that rounding never decides for a pair.
constexpr double doubt = 1e-12;
// A box of fewer points has no grid of its own; a box of fewer contacts is summed contact by contact.
constexpr std::uint32_t min_grid_points = 64;
constexpr std::uint32_t min_grid_contacts = 16;
constexpr std::size_t contact_leaf_size = 16;
// Pieces of work: enough for any sensible number of threads, each large enough not to notice being one.
constexpr std::size_t min_task_points = 1024;

// Inside the range the sums are those of exp(-2 s) and exp(-4 s), s = d^2 / R^2, one expansion each:
//   literal  sum eta v   = (G2 - beta sum v) / (1 - beta)
//   smooth   sum eta^2 v = (G4 - 2 beta G2 + beta^2 sum v) / (1 - beta)^2,  sum eta = (G2 of 1 - beta m) / (1
//   - beta)
// Component 3 of G2 carries the 1.
constexpr std::array<double, 2> expansion_rates = {falloff_rate, 2 * falloff_rate};

// The contacts in a tree, with moments and grids of each box.
struct Sources {
  PointTree tree;
  std::vector<Quad> values;  // By slot: v, 1
  std::vector<double> x, y, z, vx, vy, vz;
  std::vector<Quad> sums;  // By node: sum v, number
  struct Grid {
    GaussGrid grid;
    std::vector<Quad> values;  // Empty: none.
  };
  std::array<std::vector<Grid>, 2> grids;  // By expansion and node.

  Sources(const PointTree& points, std::span<const Contact> contacts, double squared_range, int expansions,
          double tolerance);
  ContactArrays arrays(const PointTree::Node& node) const {
    const auto b = node.begin;
    return {x.data() + b,  y.data() + b,  z.data() + b, vx.data() + b,
            vy.data() + b, vz.data() + b, node.size()};
  }
};

Sources::Sources(const PointTree& points, std::span<const Contact> contacts, double squared_range,
                 int expansions, double tolerance) {
  std::vector<Vec3> rest;
  rest.reserve(contacts.size());
  for (const Contact& c : contacts) rest.push_back(points.points()[points.slot_of(c.index)]);
  tree = PointTree(rest, contact_leaf_size);
  for (std::size_t slot = 0; slot < tree.size(); ++slot) {
    const Vec3& v = contacts[tree.index_of(slot)].displacement;
    const Vec3& p = tree.points()[slot];
    values.push_back({Wide{v.x(), v.y(), v.z(), 1}});
    x.push_back(p.x());
    y.push_back(p.y());
    z.push_back(p.z());
    vx.push_back(v.x());
    vy.push_back(v.y());
    vz.push_back(v.z());
  }
  for (const PointTree::Node& node : tree.nodes()) {
    Quad sum;
    for (auto slot = node.begin; slot < node.end; ++slot) sum.v += values[slot].v;
    sums.push_back(sum);
  }
  for (int e = 0; e < expansions; ++e) {
    const double rate = expansion_rates[static_cast<std::size_t>(e)] / squared_range;
    auto& all = grids[static_cast<std::size_t>(e)];
    all.resize(tree.nodes().size());
    for (std::size_t i = 0; i < all.size(); ++i) {
      const PointTree::Node& node = tree.nodes()[i];
      if (node.size() < min_grid_contacts) continue;
      all[i].grid = gauss_grid(node, rate, tolerance);
      // A grid of as many nodes as there are contacts would gain nothing.
      if (all[i].grid.size() == 0 || all[i].grid.size() > std::size_t{4} * node.size()) continue;
      all[i].values.resize(all[i].grid.size());
      for (auto slot = node.begin; slot < node.end; ++slot) {
        anterpolate(all[i].grid, tree.points()[slot], values[slot], all[i].values);
      }
    }
  }
}

// The walk down the tree of points, with all boxes of contacts that a box of points has still to deal with.
class Walk {
 public:
  Walk(const PointTree& points, const Sources& sources, double squared_range, Falloff falloff,
       double tolerance, std::span<Quad> sums)
      : points_(points),
        sources_(sources),
        squared_range_(squared_range),
        falloff_(falloff),
        expansions_(falloff == Falloff::literal ? 1 : 2),
        tolerance_(tolerance),
        sums_(sums) {}

  void run(std::uint32_t root) {
    open(0).assign(1, 0U);
    visit(root, 0, nullptr, Quad{});
  }

 private:
  // Grid sums over a box of points, for the expansions of the falloff.
  struct Local {
    std::array<GaussGrid, 2> grids;
    std::array<std::vector<Quad>, 2> values;  // At nodes, at last coefficients.
    bool used = false;
  };
  struct Level {
    std::vector<std::uint32_t> open;  // Boxes of contacts.
    std::vector<std::uint32_t> stack;
    Local local;
  };

  Level& level(std::size_t depth) {
    while (levels_.size() <= depth) levels_.push_back(std::make_unique<Level>());
    return *levels_[depth];
  }
  std::vector<std::uint32_t>& open(std::size_t depth) { return level(depth).open; }

  double rate(int e) const { return expansion_rates[static_cast<std::size_t>(e)] / squared_range_; }

  bool prepare(const PointTree::Node& box, Local& local) const {
    local.used = false;
    if (box.size() < min_grid_points) return false;
    for (int e = 0; e < expansions_; ++e) {
      const auto k = static_cast<std::size_t>(e);
      local.grids[k] = gauss_grid(box, rate(e), tolerance_);
      if (local.grids[k].size() == 0 || local.grids[k].size() > std::size_t{8} * box.size()) return false;
    }
    return true;
  }

  void start(Local& local) const {
    if (local.used) return;
    for (int e = 0; e < expansions_; ++e) {
      const auto k = static_cast<std::size_t>(e);
      local.values[k].assign(local.grids[k].size(), Quad{});
    }
    local.used = true;
  }

  // Adds a box of contacts, wholly in range, to the grids.
  void add_to_grids(std::uint32_t source, Local& local) {
    start(local);
    const PointTree::Node& node = sources_.tree.nodes()[source];
    for (int e = 0; e < expansions_; ++e) {
      const auto k = static_cast<std::size_t>(e);
      const Sources::Grid& grid = sources_.grids[k][source];
      if (!grid.values.empty()) {
        add_gaussians(local.grids[k], grid.grid, grid.values, rate(e), local.values[k], scratch_);
        continue;
      }
      for (auto slot = node.begin; slot < node.end; ++slot) {
        add_gaussian(local.grids[k], sources_.tree.points()[slot], sources_.values[slot], rate(e),
                     local.values[k]);
      }
    }
  }

  bool cheap_on_grids(std::uint32_t source) const {
    const PointTree::Node& node = sources_.tree.nodes()[source];
    if (node.size() < 2 * min_grid_contacts) return true;
    for (int e = 0; e < expansions_; ++e) {
      if (sources_.grids[static_cast<std::size_t>(e)][source].values.empty()) return node.leaf();
    }
    return true;
  }

  void add_pairs(const PointTree::Node& box, std::uint32_t source, const DistanceBounds& bounds) {
    add_pair_sums(std::span(points_.points()).subspan(box.begin, box.size()),
                  sources_.arrays(sources_.tree.nodes()[source]), squared_range_,
                  {bounds.least / squared_range_, bounds.largest / squared_range_}, falloff_,
                  sums_.subspan(box.begin, box.size()));
  }

  // Grid sums and moments as they enter the falloff's sums.
  void add_smooth_part(const PointTree::Node& box, const Local* local, const Quad& moments) {
    const std::size_t n = box.size();
    const auto points = std::span(points_.points()).subspan(box.begin, n);
    for (std::vector<Quad>& values : gauss_) values.assign(n, Quad{});
    if (local) {
      for (int e = 0; e < expansions_; ++e) {
        const auto k = static_cast<std::size_t>(e);
        evaluate(local->grids[k], local->values[k], points, gauss_[k]);
      }
    }
    constexpr double beta = falloff_beta, gain = 1 / (1 - falloff_beta);
    for (std::size_t i = 0; i < n; ++i) {
      const Wide g2 = gauss_[0][i].v, g4 = gauss_[1][i].v;
      const Wide linear = gain * (g2 - beta * moments.v);
      Wide sum = linear;
      if (falloff_ == Falloff::literal) {
        sum[3] = moments.v[3];
      } else {
        sum = gain * gain * (g4 - 2 * beta * g2 + beta * beta * moments.v);
        sum[3] = linear[3];
      }
      sums_[box.begin + i].v += sum;
    }
  }

  // `above`: coefficients of the parent's grids, null: none; `moments`: of the contacts in them.
  void visit(std::uint32_t index, std::size_t depth, const Local* above, Quad moments) {
    const PointTree::Node& box = points_.nodes()[index];
    Level& here = level(depth);
    Level& below = level(depth + 1);
    Local& local = here.local;
    const bool has_grids = prepare(box, local);
    below.open.clear();
    here.stack.assign(here.open.rbegin(), here.open.rend());
    const double grid_limit = squared_range_ * (falloff_ == Falloff::literal ? 1 - doubt : smooth_grid_limit);
    while (!here.stack.empty()) {
      const std::uint32_t source = here.stack.back();
      here.stack.pop_back();
      const PointTree::Node& node = sources_.tree.nodes()[source];
      const DistanceBounds bounds = squared_distance_bounds(box, node);
      if (bounds.least >= squared_range_ * (1 + doubt)) continue;
      if (bounds.largest <= grid_limit) {
        if (has_grids && cheap_on_grids(source)) {
          add_to_grids(source, local);
          moments.v += sources_.sums[source].v;
          continue;
        }
        if (box.size() < min_grid_points) {
          add_pairs(box, source, bounds);
          continue;
        }
      }
      if (box.leaf() && node.leaf()) {
        add_pairs(box, source, bounds);
      } else if (!node.leaf() && (box.leaf() || node.half.squaredNorm() > box.half.squaredNorm())) {
        here.stack.push_back(node.right);
        here.stack.push_back(node.left);
      } else {
        below.open.push_back(source);
      }
    }
    const Local* down = above;
    if (has_grids && (local.used || above)) {
      start(local);
      for (int e = 0; e < expansions_; ++e) {
        const auto k = static_cast<std::size_t>(e);
        if (above) hand_down(above->grids[k], above->values[k], local.grids[k], local.values[k], scratch_);
        to_coefficients(local.grids[k], local.values[k], scratch_);
      }
      down = &local;
    }
    const bool last_grids = box.leaf() || points_.nodes()[box.left].size() < min_grid_points;
    if (last_grids && (down || moments.v[3] > 0)) {
      add_smooth_part(box, down, moments);
      down = nullptr;
      moments = Quad{};
    }
    if (box.leaf() || (below.open.empty() && !down && !(moments.v[3] > 0))) return;
    const std::vector<std::uint32_t> rest = below.open;  // The left child overwrites it.
    visit(box.left, depth + 1, down, moments);
    level(depth + 1).open = rest;
    visit(box.right, depth + 1, down, moments);
  }

  const PointTree& points_;
  const Sources& sources_;
  double squared_range_;
  Falloff falloff_;
  int expansions_;
  double tolerance_;
  std::span<Quad> sums_;
  std::vector<std::unique_ptr<Level>> levels_;
  GridScratch scratch_;
  std::array<std::vector<Quad>, 2> gauss_;
};

// The boxes that make up all points, each of less than a task's size.
std::vector<std::uint32_t> task_roots(const PointTree& points) {
  const std::size_t largest = std::max(min_task_points, points.size() / 32);
  std::vector<std::uint32_t> roots, open{0};
  while (!open.empty()) {
    const std::uint32_t index = open.back();
    open.pop_back();
    const PointTree::Node& node = points.nodes()[index];
    if (node.leaf() || node.size() <= largest) {
      roots.push_back(index);
    } else {
      open.push_back(node.right);
      open.push_back(node.left);
    }
  }
  return roots;
}

// Less than this is no neighbour but rounding.
constexpr double least_weight = 1e-9;

// The mean of the sums (v, weight) without the point's own contact, whose eta is 1.
Vec3 mean(Quad sum, const Contact* own) {
  if (own) {
    sum.v -= Wide{own->displacement.x(), own->displacement.y(), own->displacement.z(), 1};
    if (!(sum.v[3] > least_weight)) return Vec3::Zero();
  }
  if (!(sum.v[3] > 0)) return Vec3::Zero();
  return Vec3(sum.v[0], sum.v[1], sum.v[2]) / sum.v[3];
}

}  // namespace

void run_in_turn(std::size_t count, const std::function<void(std::size_t)>& task) {
  for (std::size_t i = 0; i < count; ++i) task(i);
}

std::vector<Vec3> propagate_all_pairs(std::span<const Vec3> rest, std::span<const Contact> contacts,
                                      double squared_range_m2, Falloff falloff) {
  std::vector<Vec3> result(rest.size(), Vec3::Zero());
  if (!(squared_range_m2 > 0)) return result;
  for (std::size_t j = 0; j < rest.size(); ++j) {
    Vec3 sum = Vec3::Zero();
    double weight = 0;
    for (const Contact& contact : contacts) {
      if (contact.index == j) continue;
      const double square = squared_distance(rest[contact.index], rest[j]);
      if (!(square < squared_range_m2)) continue;
      const double eta = falloff_of_square(square / squared_range_m2);
      sum += (falloff == Falloff::literal ? eta : eta * eta) * contact.displacement;
      weight += falloff == Falloff::literal ? 1 : eta;
    }
    if (weight > 0) result[j] = sum / weight;
  }
  return result;
}

std::vector<Vec3> propagate(const PointTree& points, std::span<const Contact> contacts,
                            double squared_range_m2, Falloff falloff, const ParallelFor& parallel) {
  std::vector<Vec3> result(points.size(), Vec3::Zero());
  if (!(squared_range_m2 > 0) || contacts.empty() || points.size() == 0) return result;
  if (points.size() * contacts.size() <= all_pairs_limit) {
    std::vector<Vec3> rest(points.size());
    for (std::size_t slot = 0; slot < rest.size(); ++slot)
      rest[points.index_of(slot)] = points.points()[slot];
    return propagate_all_pairs(rest, contacts, squared_range_m2, falloff);
  }
  const double tolerance = falloff == Falloff::literal ? literal_tolerance : smooth_tolerance;
  const Sources sources(points, contacts, squared_range_m2, falloff == Falloff::literal ? 1 : 2, tolerance);
  std::vector<Quad> sums(points.size());
  std::vector<const Contact*> own(points.size(), nullptr);  // By slot.
  for (const Contact& contact : contacts) own[points.slot_of(contact.index)] = &contact;
  const std::vector<std::uint32_t> roots = task_roots(points);
  parallel(roots.size(), [&](std::size_t task) {
    Walk(points, sources, squared_range_m2, falloff, tolerance, sums).run(roots[task]);
    const PointTree::Node& box = points.nodes()[roots[task]];
    for (auto slot = box.begin; slot < box.end; ++slot) {
      result[points.index_of(slot)] = mean(sums[slot], own[slot]);
    }
  });
  return result;
}

}  // namespace handloft::geometry
