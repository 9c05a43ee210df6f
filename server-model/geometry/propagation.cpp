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
// 0.013.
constexpr double literal_tolerance = 1e-8;
constexpr double smooth_tolerance = 4e-9;
// For the smooth falloff, grids only where d^2 < 0.96 R^2, so eta > 0.013.
constexpr double smooth_grid_limit = 0.96;
// Boxes are compared with the range with this much doubt, so that rounding never decides for a pair.
constexpr double doubt = 1e-12;
// A box of fewer points has no grid of its own; a box of fewer contacts is summed contact by contact.
constexpr std::uint32_t min_grid_points = 64;
constexpr std::uint32_t min_grid_contacts = 16;
constexpr std::size_t contact_leaf_size = 16;
// Pieces of work: enough for any sensible number of threads, each large enough not to notice being one.
constexpr std::size_t min_task_points = 1024;

// Inside the range the sums are those of G = exp(-2 s) and its square, s = d^2 / R^2:
//   literal  sum eta v   = (sum G v - beta sum v) / (1 - beta)
//   smooth   sum eta^2 v = (sum G^2 v - 2 beta sum G v + beta^2 sum v) / (1 - beta)^2,
//            sum eta     = (sum G - beta m) / (1 - beta)
// One grid serves both powers. What is on grids is put together there; the moments are added at the points.
// Component 3 carries the 1.
constexpr double gain = 1 / (1 - falloff_beta);

Quad combined(Falloff falloff, const Quad* node) {
  Quad sum;
  if (falloff == Falloff::literal) {
    sum.v = gain * node[0].v;
    sum.v[3] = 0;  // m is counted.
  } else {
    sum.v = gain * gain * (node[1].v - 2 * falloff_beta * node[0].v);
    sum.v[3] = gain * node[0].v[3];
  }
  return sum;
}

Quad combined_moments(Falloff falloff, const Quad& moments) {
  Quad sum;
  if (falloff == Falloff::literal) {
    sum.v = -gain * falloff_beta * moments.v;
    sum.v[3] = moments.v[3];
  } else {
    sum.v = gain * gain * falloff_beta * falloff_beta * moments.v;
    sum.v[3] = -gain * falloff_beta * moments.v[3];
  }
  return sum;
}

// What both sides of the sums agree on.
struct Kernel {
  double squared_range;
  Falloff falloff;
  double rate() const { return falloff_rate / squared_range; }
  /// Values a node: G, and its square for the smooth falloff.
  std::size_t powers() const { return falloff == Falloff::literal ? 1 : 2; }
  GaussGrid grid(const PointTree::Node& box) const {
    return falloff == Falloff::literal ? gauss_grid(box, rate(), literal_tolerance)
                                       : gauss_grid(box, 2 * rate(), smooth_tolerance);
  }
};

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
  std::vector<Grid> grids;  // By node.

  Sources(const PointTree& points, std::span<const Contact> contacts, const Kernel& kernel,
          const ParallelFor& parallel);
  ContactArrays arrays(const PointTree::Node& node) const {
    const auto b = node.begin;
    return {x.data() + b,  y.data() + b,  z.data() + b, vx.data() + b,
            vy.data() + b, vz.data() + b, node.size()};
  }
};

Sources::Sources(const PointTree& points, std::span<const Contact> contacts, const Kernel& kernel,
                 const ParallelFor& parallel) {
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
  grids.resize(tree.nodes().size());
  parallel(grids.size(), [&](std::size_t i) {
    const PointTree::Node& node = tree.nodes()[i];
    if (node.size() < min_grid_contacts) return;
    Grid& one = grids[i];
    one.grid = kernel.grid(node);
    // A grid of as many nodes as there are contacts would gain nothing.
    if (one.grid.size() == 0 || one.grid.size() > std::size_t{4} * node.size()) return;
    one.values.resize(one.grid.size());
    for (auto slot = node.begin; slot < node.end; ++slot) {
      anterpolate(one.grid, tree.points()[slot], values[slot], one.values);
    }
  });
}

// The walk down the tree of points, with all boxes of contacts that a box of points has still to deal with.
class Walk {
 public:
  /// `sums`: of the points of `root`.
  Walk(const PointTree& points, const Sources& sources, const Kernel& kernel, std::uint32_t root,
       std::span<Quad> sums)
      : points_(points),
        sources_(sources),
        kernel_(kernel),
        root_(root),
        first_(points.nodes()[root].begin),
        sums_(sums) {}

  void run() {
    open(0).assign(1, 0U);
    visit(root_, 0, nullptr, Quad{});
  }

 private:
  // Grid sums over a box of points.
  struct Local {
    GaussGrid grid;
    std::vector<Quad> powers;  // At nodes: as many as the kernel has.
    std::vector<Quad> values;  // At nodes, at last coefficients.
    bool used = false;
  };
  struct Level {
    std::vector<std::uint32_t> open;  // Boxes of contacts.
    std::vector<std::uint32_t> stack;
    std::vector<std::uint32_t> rest;
    Local local;
  };

  Level& level(std::size_t depth) {
    while (levels_.size() <= depth) levels_.push_back(std::make_unique<Level>());
    return *levels_[depth];
  }
  std::vector<std::uint32_t>& open(std::size_t depth) { return level(depth).open; }

  bool prepare(const PointTree::Node& box, Local& local) const {
    local.used = false;
    if (box.size() < min_grid_points) return false;
    local.grid = kernel_.grid(box);
    return local.grid.size() > 0 && local.grid.size() <= std::size_t{8} * box.size();
  }

  // Adds a box of contacts, wholly in range, to the grid.
  void add_to_grid(std::uint32_t source, Local& local) {
    if (!local.used) local.powers.assign(local.grid.size() * kernel_.powers(), Quad{});
    local.used = true;
    const auto add = [&](const GaussGrid& from, std::span<const Quad> values) {
      if (kernel_.falloff == Falloff::literal) {
        add_gaussians(local.grid, from, values, kernel_.rate(), local.powers, scratch_);
      } else {
        add_gaussians_and_squares(local.grid, from, values, kernel_.rate(), local.powers, scratch_);
      }
    };
    const Sources::Grid& grid = sources_.grids[source];
    if (!grid.values.empty()) {
      add(grid.grid, grid.values);
      return;
    }
    const PointTree::Node& node = sources_.tree.nodes()[source];
    for (auto slot = node.begin; slot < node.end; ++slot) {
      add(grid_of_point(sources_.tree.points()[slot]), std::span(&sources_.values[slot], 1));
    }
  }

  // The powers put together, with what comes from above, as coefficients.
  void finish(Local& local, const Local* above) {
    const std::size_t n = local.grid.size();
    local.values.assign(n, Quad{});
    if (local.used) {
      for (std::size_t i = 0; i < n; ++i) {
        local.values[i] = combined(kernel_.falloff, &local.powers[i * kernel_.powers()]);
      }
    }
    if (above) hand_down(above->grid, above->values, local.grid, local.values, scratch_);
    to_coefficients(local.grid, local.values, scratch_);
  }

  bool cheap_on_grids(std::uint32_t source) const {
    const PointTree::Node& node = sources_.tree.nodes()[source];
    return node.size() < 2 * min_grid_contacts || !sources_.grids[source].values.empty() || node.leaf();
  }

  std::span<Quad> sums_of(const PointTree::Node& box) const {
    return sums_.subspan(box.begin - first_, box.size());
  }
  std::span<const Vec3> points_of(const PointTree::Node& box) const {
    return std::span(points_.points()).subspan(box.begin, box.size());
  }

  void add_pairs(const PointTree::Node& box, std::uint32_t source, const DistanceBounds& bounds) {
    const double square = kernel_.squared_range;
    add_pair_sums(points_of(box), sources_.arrays(sources_.tree.nodes()[source]), square,
                  {bounds.least / square, bounds.largest / square}, kernel_.falloff, sums_of(box));
  }

  // Grid sums and moments as they enter the falloff's sums.
  void add_smooth_part(const PointTree::Node& box, const Local* local, const Quad& moments) {
    const std::span<Quad> sums = sums_of(box);
    const Quad constant = combined_moments(kernel_.falloff, moments);
    for (Quad& sum : sums) sum.v += constant.v;
    if (local) evaluate(local->grid, local->values, points_of(box), sums);
  }

  // `above`: coefficients of the parent's grids, null: none; `moments`: of the contacts in them.
  void visit(std::uint32_t index, std::size_t depth, const Local* above, Quad moments) {
    const PointTree::Node& box = points_.nodes()[index];
    Level& here = level(depth);
    Level& below = level(depth + 1);
    Local& local = here.local;
    const bool has_grid = prepare(box, local);
    below.open.clear();
    here.stack.assign(here.open.rbegin(), here.open.rend());
    const double squared_range = kernel_.squared_range;
    const double grid_limit =
        squared_range * (kernel_.falloff == Falloff::literal ? 1 - doubt : smooth_grid_limit);
    while (!here.stack.empty()) {
      const std::uint32_t source = here.stack.back();
      here.stack.pop_back();
      const PointTree::Node& node = sources_.tree.nodes()[source];
      const DistanceBounds bounds = squared_distance_bounds(box, node);
      if (bounds.least >= squared_range * (1 + doubt)) continue;
      if (bounds.largest <= grid_limit) {
        if (has_grid && cheap_on_grids(source)) {
          add_to_grid(source, local);
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
    if (has_grid && (local.used || above)) {
      finish(local, above);
      down = &local;
    }
    const bool last_grid = box.leaf() || points_.nodes()[box.left].size() < min_grid_points;
    if (last_grid && (down || moments.v[3] > 0)) {
      add_smooth_part(box, down, moments);
      down = nullptr;
      moments = Quad{};
    }
    if (box.leaf() || (below.open.empty() && !down && !(moments.v[3] > 0))) return;
    here.rest = below.open;  // The left child overwrites it.
    visit(box.left, depth + 1, down, moments);
    below.open = here.rest;
    visit(box.right, depth + 1, down, moments);
  }

  const PointTree& points_;
  const Sources& sources_;
  Kernel kernel_;
  std::uint32_t root_;
  std::uint32_t first_;  // Slot
  std::span<Quad> sums_;
  std::vector<std::unique_ptr<Level>> levels_;
  GridScratch scratch_;
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

// The sums of eq. 5 at one point, a contact at a time.
struct ExactSums {
  Falloff falloff;
  Vec3 sum = Vec3::Zero();
  double weight = 0;

  void add(double squared_distance, double squared_range, const Vec3& displacement) {
    if (!(squared_distance < squared_range)) return;
    const double eta = falloff_of_square(squared_distance / squared_range);
    sum += (falloff == Falloff::literal ? eta : eta * eta) * displacement;
    weight += falloff == Falloff::literal ? 1 : eta;
  }
  Vec3 mean() const { return weight > 0 ? Vec3(sum / weight) : Vec3::Zero(); }
};

// Where less than this remains of the weight at a contact, the error of its own share, 1 in all sums, is too
// much to divide by it.
constexpr double least_rest = 0.1;

// The mean of the sums (v, weight) without the point's own contact, whose eta is 1.
Vec3 mean(const Quad& sum, const Contact* own, std::size_t own_index, const Sources& sources,
          const Kernel& kernel, const Vec3& point) {
  Wide v = sum.v;
  if (own) {
    v -= Wide{own->displacement.x(), own->displacement.y(), own->displacement.z(), 1};
    if (!(v[3] > least_rest)) {
      ExactSums exact{kernel.falloff};
      sources.tree.near_segment(
          point, point, (1 + doubt) * std::sqrt(kernel.squared_range), [&](std::uint32_t slot) {
            if (sources.tree.index_of(slot) == own_index) return;
            exact.add(squared_distance(sources.tree.points()[slot], point), kernel.squared_range,
                      {sources.vx[slot], sources.vy[slot], sources.vz[slot]});
          });
      return exact.mean();
    }
  }
  return v[3] > 0 ? Vec3(Vec3(v[0], v[1], v[2]) / v[3]) : Vec3::Zero();
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
    ExactSums sums{falloff};
    for (const Contact& contact : contacts) {
      if (contact.index != j)
        sums.add(squared_distance(rest[contact.index], rest[j]), squared_range_m2, contact.displacement);
    }
    result[j] = sums.mean();
  }
  return result;
}

std::vector<Vec3> propagate(const PointTree& points, std::span<const Contact> contacts,
                            double squared_range_m2, Falloff falloff, const ParallelFor& parallel) {
  if (!(squared_range_m2 > 0) || contacts.empty() || points.size() == 0) {
    return std::vector<Vec3>(points.size(), Vec3::Zero());
  }
  if (points.size() * contacts.size() <= all_pairs_limit) {
    std::vector<Vec3> rest(points.size());
    for (std::size_t slot = 0; slot < rest.size(); ++slot)
      rest[points.index_of(slot)] = points.points()[slot];
    return propagate_all_pairs(rest, contacts, squared_range_m2, falloff);
  }
  const Kernel kernel{squared_range_m2, falloff};
  const Sources sources(points, contacts, kernel, parallel);
  struct Own {
    std::uint32_t slot;
    const Contact* contact;
  };
  std::vector<Own> own;
  own.reserve(contacts.size());
  for (const Contact& contact : contacts) own.push_back({points.slot_of(contact.index), &contact});
  std::sort(own.begin(), own.end(), [](const Own& a, const Own& b) { return a.slot < b.slot; });
  const std::vector<std::uint32_t> roots = task_roots(points);
  // Not filled here: the tasks write all of it, and so share the first touch of its pages.
  std::vector<Vec3> result(points.size());
  parallel(roots.size(), [&](std::size_t task) {
    const PointTree::Node& box = points.nodes()[roots[task]];
    std::vector<Quad> sums(box.size());
    Walk(points, sources, kernel, roots[task], sums).run();
    auto next = std::lower_bound(own.begin(), own.end(), box.begin,
                                 [](const Own& one, std::uint32_t slot) { return one.slot < slot; });
    for (auto slot = box.begin; slot < box.end; ++slot) {
      const Contact* contact = next != own.end() && next->slot == slot ? (next++)->contact : nullptr;
      const auto index = static_cast<std::size_t>(contact ? contact - contacts.data() : 0);
      result[points.index_of(slot)] =
          mean(sums[slot - box.begin], contact, index, sources, kernel, points.points()[slot]);
    }
  });
  return result;
}

}  // namespace handloft::geometry
