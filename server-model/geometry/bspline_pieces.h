#pragma once
// The Bezier pieces of a B-spline surface, one a span, in one block of memory, with what searches need of
// each: a tight box along its own axes and how far from it a closest point is sure to be the only one. The
// pieces are linear in the control points with coefficients of the knots alone (Borden and others,
// "Isogeometric finite element data structures based on Bezier extraction of NURBS", 2011), so a surface that
// moves makes its pieces again without a knot inserted.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server-model/geometry/box_tree.h"
#include "server-model/geometry/bspline_surface.h"

namespace handloft::geometry {

/// The spans of one direction and each one's Bezier extraction.
struct SpanExtraction {
  explicit SpanExtraction(const KnotVector& knots);

  int degree = 1;
  std::vector<double> bounds;       ///< Where the spans meet, ascending, with both ends of the domain.
  std::vector<int> first_function;  ///< One a span.
  std::vector<double> matrix;       ///< (p + 1)^2 a span: Bezier k = sum_i matrix[k (p + 1) + i] * control i.

  int count() const { return static_cast<int>(first_function.size()); }
  /// The span that holds u; the nearest one for places outside.
  int find(double u) const;
  const double* of(int span) const {
    return matrix.data() + static_cast<std::size_t>(span) * (static_cast<std::size_t>(degree) + 1) *
                               (static_cast<std::size_t>(degree) + 1);
  }
};

/// With respect to a piece's own parameters in 0..1.
struct PieceDerivatives {
  Vec3 s, su, sv, suu, suv, svv;
};

/// A box along a piece's own axes, and its reach: |p - s|^2 is strictly convex over the piece for places p
/// all of whose distances to it are less (the least eigenvalue of the first fundamental form stays above the
/// distance times the largest second derivative).
struct PieceBound {
  Vec3 centre = Vec3::Zero();
  std::array<Vec3, 3> axis = {Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()};
  Vec3 half = Vec3::Zero();
  double radius = 0;  ///< |half|.
  double reach = 0;
  double bend_uu = 0, bend_uv = 0, bend_vv = 0;  ///< No second derivative is larger (piece's own parameters).

  double squared_distance(const Vec3& p) const {
    const Vec3 d = p - centre;
    double sum = 0;
    for (int k = 0; k < 3; ++k) {
      const double over = std::max(0.0, std::abs(axis[static_cast<std::size_t>(k)].dot(d)) - half[k]);
      sum += over * over;
    }
    return sum;
  }
};

class BezierPieces {
 public:
  explicit BezierPieces(const BSplineSurface& surface);

  int rows() const { return u_.count(); }
  int columns() const { return v_.count(); }
  std::size_t size() const { return bounds_.size(); }
  std::size_t index(int i, int j) const {
    return static_cast<std::size_t>(i) * static_cast<std::size_t>(columns()) + static_cast<std::size_t>(j);
  }
  const SpanExtraction& u() const { return u_; }
  const SpanExtraction& v() const { return v_; }
  int degree_u() const { return u_.degree; }
  int degree_v() const { return v_.degree; }
  bool is_rational() const { return !weights_.empty(); }

  /// Pieces that depend on control points for which `moved` holds 1 (one a control point): marks them in
  /// `touched` (one a piece).
  void mark(std::span<const std::uint8_t> moved, std::vector<std::uint8_t>& touched) const;
  /// Makes the pieces again for which `touched` holds 1; all when it is empty.
  void update(std::span<const Vec3> control, std::span<const std::uint8_t> touched);

  const PieceBound& bound(std::size_t piece) const { return bounds_[piece]; }
  const std::vector<Box3>& boxes() const { return boxes_; }

  /// Bezier points, component by component: x, y, z (times the weight) and, when rational, the weight; place
  /// a * (q + 1) + b in each.
  const double* coefficients(std::size_t piece) const { return coefficients_.data() + piece * stride_; }
  std::size_t component_size() const { return component_; }
  /// At s, t in 0..1.
  void derivatives(std::size_t piece, double s, double t, PieceDerivatives& d) const {
    evaluate_(coefficients(piece), u_.degree, v_.degree, s, t, d);
  }

  /// The surface's parameters of a place in a piece, and back (the piece that holds them).
  Vec2 parameters(std::size_t piece, double s, double t) const;
  std::size_t locate(const Vec2& uv, double& s, double& t) const;

 private:
  using Evaluate = void (*)(const double*, int, int, double, double, PieceDerivatives&);

  void extract(std::size_t piece, std::span<const Vec3> control, std::vector<double>& scratch);
  void bound_piece(std::size_t piece);

  SpanExtraction u_, v_;
  std::vector<int> column_of_, row_of_;  ///< Control index of each function.
  int control_columns_ = 0, control_rows_ = 0;
  std::vector<double> weights_;
  std::size_t component_ = 0, stride_ = 0;
  std::vector<double> coefficients_;
  std::vector<PieceBound> bounds_;
  std::vector<Box3> boxes_;
  Evaluate evaluate_ = nullptr;
};

}  // namespace handloft::geometry
