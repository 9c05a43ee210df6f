#include "server-model/geometry/sculpt_energy.h"

#include <fmt/format.h>

#include <cassert>
#include <cmath>
#include <utility>

#include "server-model/geometry/gauss_rule.h"
#include "server-model/geometry/stiffness_solver.h"

namespace handloft::geometry {

namespace {

// The grams of one direction that the energy asks for, all of one sparsity pattern.
struct Grams {
  Eigen::SparseMatrix<double> g00, g11, g22, g10, g01;
};

Grams grams(const KnotVector& knots) {
  return {gram_matrix(knots, 0, 0), gram_matrix(knots, 1, 1), gram_matrix(knots, 2, 2),
          gram_matrix(knots, 1, 0), gram_matrix(knots, 0, 1)};
}

}  // namespace

Status check(const SculptEnergy& energy) {
  const auto fail = [](const char* field, double found, const char* expected) -> Status {
    return make_error(ErrorCode::invalid_argument, fmt::format("found {}, expected {}", found, expected),
                      fmt::format("energy.{}", field));
  };
  const std::array<std::pair<const char*, double>, 5> signed_terms{{{"a11", energy.a11},
                                                                    {"a22", energy.a22},
                                                                    {"b11", energy.b11},
                                                                    {"b12", energy.b12},
                                                                    {"b22", energy.b22}}};
  double sum = 0;
  for (const auto& [field, value] : signed_terms) {
    if (!std::isfinite(value) || value < 0) return fail(field, value, "a finite number of at least 0");
    sum += value;
  }
  if (!std::isfinite(energy.a12)) return fail("a12", energy.a12, "a finite number");
  if (energy.a11 * energy.a22 < energy.a12 * energy.a12)
    return fail("a12", energy.a12, "a12^2 of at most a11 a22");
  if (!(sum > 0)) return fail("b11", energy.b11, "some term above 0");
  return {};
}

Eigen::SparseMatrix<double> gram_matrix(const KnotVector& knots, int a, int b) {
  assert(a >= 0 && a <= 2 && b >= 0 && b <= 2);
  const int width = knots.degree() + 1;
  const auto places = static_cast<std::size_t>(width);
  const GaussRule rule = gauss_rule(width);
  std::vector<double> values(3 * places);
  std::vector<double> block(places * places);
  std::vector<Eigen::Triplet<double>> entries;
  const std::vector<int> spans = knots.spans();
  entries.reserve(spans.size() * block.size());
  for (const int span : spans) {
    const double lower = knots.knots()[static_cast<std::size_t>(span)];
    const double upper = knots.knots()[static_cast<std::size_t>(span) + 1];
    const double half = (upper - lower) / 2;
    std::fill(block.begin(), block.end(), 0.0);
    for (std::size_t g = 0; g < places; ++g) {
      basis_functions(knots, span, lower + half * (1 + rule.node[g]), 2, values);
      const double weight = half * rule.weight[g];
      const double* row = values.data() + static_cast<std::size_t>(a) * places;
      const double* column = values.data() + static_cast<std::size_t>(b) * places;
      // The weight last: so that the entry and its mirror image have the same bits.
      for (std::size_t i = 0; i < places; ++i)
        for (std::size_t j = 0; j < places; ++j) block[i * places + j] += weight * (row[i] * column[j]);
    }
    const int first = span - knots.degree();
    for (int i = 0; i < width; ++i)
      for (int j = 0; j < width; ++j)
        entries.emplace_back(knots.control_of(first + i), knots.control_of(first + j),
                             block[static_cast<std::size_t>(i) * places + static_cast<std::size_t>(j)]);
  }
  Eigen::SparseMatrix<double> gram(knots.control_count(), knots.control_count());
  gram.setFromTriplets(entries.begin(), entries.end());
  return gram;
}

namespace {

Grams part_of(const Grams& all, const std::vector<std::uint32_t>& points) {
  return {principal_part(all.g00, points), principal_part(all.g11, points), principal_part(all.g22, points),
          principal_part(all.g10, points), principal_part(all.g01, points)};
}

Eigen::SparseMatrix<double> stiffness_of(const Grams& gu, const Grams& gv, const SculptEnergy& energy) {
  const Eigen::Index nu = gu.g00.cols();
  const Eigen::Index nv = gv.g00.cols();
  Eigen::SparseMatrix<double> k(nu * nv, nu * nv);
  k.reserve(gu.g00.nonZeros() * gv.g00.nonZeros());
  const auto place = [](const Eigen::SparseMatrix<double>& m, Eigen::Index at) { return m.valuePtr()[at]; };
  // Column by column; all grams of a direction share their pattern, so one index walks them all.
  for (Eigen::Index i = 0; i < nu; ++i) {
    for (Eigen::Index j = 0; j < nv; ++j) {
      k.startVec(i * nv + j);
      for (Eigen::Index p = gu.g00.outerIndexPtr()[i]; p < gu.g00.outerIndexPtr()[i + 1]; ++p) {
        for (Eigen::Index q = gv.g00.outerIndexPtr()[j]; q < gv.g00.outerIndexPtr()[j + 1]; ++q) {
          const double stretch_u = energy.a11 * (place(gu.g11, p) * place(gv.g00, q));
          const double stretch_v = energy.a22 * (place(gu.g00, p) * place(gv.g11, q));
          const double shear =
              energy.a12 * (place(gu.g10, p) * place(gv.g01, q) + place(gu.g01, p) * place(gv.g10, q));
          const double bend_u = energy.b11 * (place(gu.g22, p) * place(gv.g00, q));
          const double twist = 2 * energy.b12 * (place(gu.g11, p) * place(gv.g11, q));
          const double bend_v = energy.b22 * (place(gu.g00, p) * place(gv.g22, q));
          k.insertBack(gu.g00.innerIndexPtr()[p] * nv + gv.g00.innerIndexPtr()[q], i * nv + j) =
              stretch_u + stretch_v + shear + bend_u + twist + bend_v;
        }
      }
    }
  }
  k.finalize();
  return k;
}

}  // namespace

Eigen::SparseMatrix<double> stiffness(const KnotVector& u, const KnotVector& v, const SculptEnergy& energy) {
  return stiffness_of(grams(u), grams(v), energy);
}

Eigen::SparseMatrix<double> stiffness(const KnotVector& u, const KnotVector& v, const SculptEnergy& energy,
                                      const std::vector<std::uint32_t>& rows,
                                      const std::vector<std::uint32_t>& columns) {
  return stiffness_of(part_of(grams(u), rows), part_of(grams(v), columns), energy);
}

Eigen::SparseMatrix<double> curve_stiffness(const KnotVector& knots, double alpha, double beta) {
  return alpha * gram_matrix(knots, 1, 1) + beta * gram_matrix(knots, 2, 2);
}

std::vector<std::uint32_t> movable_points(const KnotVector& u, const KnotVector& v,
                                          const SculptSupports& supports) {
  const auto held = [](Support support) { return static_cast<int>(support); };  // Rows: 0, 1 or 2.
  const int first_i = u.is_periodic() ? 0 : held(supports.u_lower);
  const int last_i = u.control_count() - (u.is_periodic() ? 0 : held(supports.u_upper));
  const int first_j = v.is_periodic() ? 0 : held(supports.v_lower);
  const int last_j = v.control_count() - (v.is_periodic() ? 0 : held(supports.v_upper));
  std::vector<std::uint32_t> movable;
  for (int i = first_i; i < last_i; ++i)
    for (int j = first_j; j < last_j; ++j)
      movable.push_back(static_cast<std::uint32_t>(i) * static_cast<std::uint32_t>(v.control_count()) +
                        static_cast<std::uint32_t>(j));
  return movable;
}

StiffnessProduct::StiffnessProduct(const KnotVector& u, const KnotVector& v, const SculptEnergy& energy) {
  const Grams gu = grams(u);
  const Grams gv = grams(v);
  terms_.push_back({gu.g11, energy.a11 * gv.g00 + 2 * energy.b12 * gv.g11});
  if (energy.b11 > 0) terms_.push_back({gu.g22, energy.b11 * gv.g00});
  if (energy.a22 > 0 || energy.b22 > 0) terms_.push_back({gu.g00, energy.a22 * gv.g11 + energy.b22 * gv.g22});
  if (energy.a12 != 0) {
    terms_.push_back({gu.g10, energy.a12 * gv.g01});
    terms_.push_back({gu.g01, energy.a12 * gv.g10});
  }
}

Eigen::VectorXd StiffnessProduct::operator()(const Eigen::VectorXd& x) const {
  const Eigen::Index nu = terms_.front().u.rows();
  const Eigen::Index nv = terms_.front().v.rows();
  const Eigen::Map<const Eigen::MatrixXd> grid(x.data(), nv, nu);  // control(i, j) at column i, row j.
  Eigen::VectorXd product = Eigen::VectorXd::Zero(x.size());
  Eigen::Map<Eigen::MatrixXd> sum(product.data(), nv, nu);
  Eigen::MatrixXd along_v(nv, nu);
  for (const Term& term : terms_) {
    along_v.noalias() = term.v * grid;
    // Column c of the sum: the combination of columns that row c of u's gram says.
    for (Eigen::Index r = 0; r < nu; ++r)
      for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator at(term.u, r); at; ++at)
        sum.col(r) += at.value() * along_v.col(at.col());
  }
  return product;
}

}  // namespace handloft::geometry
