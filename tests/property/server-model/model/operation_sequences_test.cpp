// Random sequences of all operations: none leaves NaN or breaks an invariant of the document (X5, A12), and
// undoing them one by one gives back every document to the bit, by its canonical hash (A28).
// A new operation is one more row of `makers`; what it must keep is one more line of broken_invariant().

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "any_operation.h"
#include "server-model/geometry/symmetry.h"
#include "server-model/model/canonical.h"
#include "server-model/model/model.h"
#include "tests/support/build_kind.h"

namespace handloft::model {
namespace {

namespace v1 = handloft::v1;

constexpr int bad_one_in = 300;  // Numbers that must be refused.

/// 1,000 sequences of up to 60 operations, which are some 0.7 s here; a sanitized build is ten
/// times as slow, and does a tenth.
constexpr int cases = 100;
constexpr int sequences_per_case = handloft::test::sanitized ? 1 : 10;
constexpr int longest_sequence = 60;

// --- numbers: full-sized from the first case on, mostly ordinary, sometimes what must be refused

std::string any_id() {
  return *rc::gen::element<std::string>("a", "b", "a-mirror", "b-mirror", "shape-1", "shape-2",
                                        "reference-1");
}

std::uint32_t small_number(int below) {
  return static_cast<std::uint32_t>(test::in_range(0, below));
}

v1::Point any_point() {
  v1::Point point;
  *point.mutable_position() = test::any_vector(bad_one_in);
  point.set_pressure(0.1 * test::in_range(0, 11));
  return point;
}

v1::SetSymmetry any_symmetry(const std::string& id) {
  v1::SetSymmetry symmetry;
  symmetry.set_entity(id);
  symmetry.set_mode(static_cast<v1::SetSymmetry::Mode>(test::in_range(0, 3)));
  *symmetry.mutable_plane()->mutable_origin() = test::any_vector(bad_one_in);
  *symmetry.mutable_plane()->mutable_normal() = test::any_vector(bad_one_in);
  return symmetry;
}

v1::PointRegion any_region() {
  v1::PointRegion region;
  switch (test::in_range(0, 4)) {
    case 0:
      *region.mutable_sphere()->mutable_centre() = test::any_vector(bad_one_in);
      region.mutable_sphere()->set_radius_m(0.01 * test::in_range(0, 20));
      break;
    case 1: {
      const v1::Vec3 corner = test::any_vector(bad_one_in);
      *region.mutable_box()->mutable_minimum() = corner;
      region.mutable_box()->mutable_maximum()->set_x(corner.x() + 0.2);
      region.mutable_box()->mutable_maximum()->set_y(corner.y() + 0.2);
      region.mutable_box()->mutable_maximum()->set_z(corner.z() + 0.2);
      break;
    }
    case 2:
      region.mutable_strokes()->add_numbers(1 + small_number(4));
      break;
    default:
      for (int i = test::in_range(0, 4); i > 0; --i) region.mutable_indices()->add_indices(small_number(12));
      region.mutable_indices();
  }
  return region;
}

/// Round the footprint of shapes, or any knot.
std::vector<v1::Vec3> any_curve() {
  std::vector<v1::Vec3> curve;
  if (test::in_range(0, 3) == 0) {
    for (int i = test::in_range(0, 8); i > 0; --i) curve.push_back(test::any_vector(bad_one_in));
    return curve;
  }
  const double radius = 0.01 * test::in_range(1, 30);
  for (int i = 0; i < 24; ++i) {
    v1::Vec3 place;
    place.set_x(radius * std::cos(0.262 * i));
    place.set_y(radius * std::sin(0.262 * i));
    place.set_z(0.02 * std::cos(0.524 * i));
    curve.push_back(place);
  }
  return curve;
}

// --- one maker for every operation

struct Maker {
  const char* name;
  int weight;
  void (*fill)(const std::string& id, v1::Operation& operation);
};

const std::array makers{
    Maker{"create_dual_shape", 2,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_create_dual_shape()->set_id(*rc::gen::element(id, std::string("")));
            operation.mutable_create_dual_shape()->set_degree(small_number(8));
          }},
    Maker{"add_points", 8,
          [](const std::string& id, v1::Operation& operation) {
            auto& request = *operation.mutable_add_points();
            request.set_entity(id);
            request.set_stroke(small_number(4) % 3);
            request.set_min_spacing_m(0.01 * test::in_range(0, 3));
            request.set_refit(test::in_range(0, 3) == 0);
            if (test::in_range(0, 4) == 0) request.mutable_create();
            if (test::in_range(0, 8) == 0) *request.mutable_symmetry() = any_symmetry(id);
            for (int i = test::in_range(0, 16); i > 0; --i) *request.add_points() = any_point();
          }},
    Maker{"import_strokes", 2,
          [](const std::string& id, v1::Operation& operation) {
            // As the session hands it on: read from the file, without its path.
            auto& request = *operation.mutable_import_strokes();
            request.set_entity(id);
            for (int k = test::in_range(0, 4); k > 0; --k) {
              auto& stroke = *request.add_resolved();
              for (int i = test::in_range(1, 8); i > 0; --i) *stroke.add_points() = any_point();
            }
          }},
    Maker{"set_symmetry", 1,
          [](const std::string& id, v1::Operation& operation) {
            *operation.mutable_set_symmetry() = any_symmetry(id);
          }},
    Maker{"fit", 4,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_fit()->set_entity(id);
            operation.mutable_fit()->set_degree(small_number(7));
            operation.mutable_fit()->set_automatic_degree(test::in_range(0, 3) == 0);
          }},
    Maker{"refit_plane", 1,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_refit_plane()->set_entity(id);
          }},
    Maker{"set_superellipse", 1,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_set_superellipse()->set_entity(id);
            operation.mutable_set_superellipse()->set_exponent(0.1 * test::in_range(0, 220));
          }},
    Maker{"set_representation", 1,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_set_representation()->set_entity(id);
            operation.mutable_set_representation()->set_representation(
                static_cast<v1::Representation>(test::in_range(0, 4)));
          }},
    Maker{"rename", 1,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_rename()->set_entity(id);
            operation.mutable_rename()->set_name(*rc::gen::element<std::string>("x", "y", ""));
          }},
    Maker{
        "delete", 1,
        [](const std::string& id, v1::Operation& operation) { operation.mutable_delete_()->set_entity(id); }},
    Maker{"delete_points", 2,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_delete_points()->set_entity(id);
            *operation.mutable_delete_points()->mutable_region() = any_region();
          }},
    Maker{"move_points", 2,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_move_points()->set_entity(id);
            *operation.mutable_move_points()->mutable_region() = any_region();
            *operation.mutable_move_points()->mutable_by() = test::any_vector(bad_one_in);
          }},
    Maker{"transform", 2,
          [](const std::string& id, v1::Operation& operation) {
            auto& request = *operation.mutable_transform();
            request.add_entities(id);
            if (test::in_range(0, 4) == 0) request.add_entities(any_id());
            *request.mutable_translation() = test::any_vector(bad_one_in);
            if (test::in_range(0, 2) == 0) {
              request.mutable_rotation()->set_w(test::any_length(bad_one_in));
              request.mutable_rotation()->set_x(test::any_length(bad_one_in));
              request.mutable_rotation()->set_y(test::any_length(bad_one_in));
            }
            if (test::in_range(0, 2) == 0)
              request.set_scale(*rc::gen::element(0.5, 0.9, 1.25, 2.0, 0.0, -1.0));
            if (test::in_range(0, 2) == 0) *request.mutable_pivot() = test::any_vector(bad_one_in);
          }},
    Maker{"duplicate", 1,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_duplicate()->set_entity(id);
            operation.mutable_duplicate()->set_id(*rc::gen::element(any_id(), std::string("")));
            *operation.mutable_duplicate()->mutable_translation() = test::any_vector(bad_one_in);
          }},
    Maker{"set_boundary", 2,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_set_boundary()->set_entity(id);
            for (const v1::Vec3& place : any_curve()) *operation.mutable_set_boundary()->add_curve() = place;
          }},
    Maker{"push_points", 2,
          [](const std::string& id, v1::Operation& operation) {
            auto& request = *operation.mutable_push_points();
            request.add_entities(id);
            request.set_range(0.1 * test::in_range(0, 11));
            request.set_falloff(static_cast<v1::Falloff>(test::in_range(0, 2)));
            request.set_refit(test::in_range(0, 2) == 0);
            v1::Vec3 normal;
            normal.set_z(1);
            for (int i = 0; i < test::in_range(2, 5); ++i) {
              auto& pose = *request.add_path();
              *pose.mutable_centre() = test::any_vector(bad_one_in);
              *pose.mutable_normal() = test::in_range(0, 4) == 0 ? test::any_vector(bad_one_in) : normal;
              pose.set_radius_m(0.01 * test::in_range(1, 20));
              pose.set_time_ns(11'000'000LL * i);
            }
          }},
    Maker{"modify_profile", 6,
          [](const std::string& id, v1::Operation& operation) {
            auto& request = *operation.mutable_modify_profile();
            for (int k = test::in_range(1, 3); k > 0; --k) {
              auto& curve = *request.add_curves();
              for (int i = test::in_range(0, 12); i > 0; --i) *curve.add_points() = any_point();
              switch (test::in_range(0, 4)) {
                case 0:
                  curve.set_entity(id);
                  break;
                case 1:
                  curve.add_split_at(0.1 * test::in_range(0, 11));
                  curve.add_split_entities(id);
                  curve.add_split_entities(*rc::gen::element(any_id(), std::string("")));
                  break;
                default:
                  break;
              }
            }
            if (test::in_range(0, 3) == 0) {
              for (int k = test::in_range(1, 3); k > 0; --k) request.add_entities(any_id());
            }
            request.set_keep_as_points(test::in_range(0, 2) == 0);
          }},
    Maker{"import_reference", 1,
          [](const std::string& id, v1::Operation& operation) {
            auto& request = *operation.mutable_import_reference();
            request.set_id(*rc::gen::element(id, std::string("")));
            for (int i = 0; i < 12; ++i)
              request.mutable_resolved()->add_positions(0.01F * static_cast<float>(test::in_range(-20, 20)));
            for (int i = 0; i < 6; ++i) request.mutable_resolved()->add_indices(small_number(4));
          }},
    Maker{"new_alternative", 1,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_new_alternative()->set_name(*rc::gen::element(id, std::string("")));
          }},
    Maker{"switch_alternative", 2,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_switch_alternative()->set_name(*rc::gen::element(id, std::string("main")));
          }},
    Maker{"restore_alternative", 1,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_restore_alternative()->set_name(*rc::gen::element(id, std::string("main")));
          }},
    Maker{"delete_alternative", 1,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_delete_alternative()->set_name(*rc::gen::element(id, std::string("main")));
          }},
    Maker{"undo", 2, [](const std::string&, v1::Operation& operation) { operation.mutable_undo(); }},
    Maker{"redo", 1, [](const std::string&, v1::Operation& operation) { operation.mutable_redo(); }},
};

struct Made {
  const char* name;
  v1::Operation operation;
};

Made any_operation() {
  int total = 0;
  for (const Maker& maker : makers) total += maker.weight;
  int pick = test::in_range(0, total);
  for (const Maker& maker : makers) {
    pick -= maker.weight;
    if (pick >= 0) continue;
    Made made{maker.name, {}};
    maker.fill(any_id(), made.operation);
    return made;
  }
  return {};
}

/// Something to work on, or most operations would only learn that there is no such entity: two shapes of 20
/// points each, mirrored as chance has it.
std::vector<Made> any_sequence() {
  std::vector<Made> sequence;
  for (const char* id : {"a", "b"}) {
    Made made{"add_points", {}};
    auto& request = *made.operation.mutable_add_points();
    request.set_entity(id);
    request.mutable_create()->set_degree(1 + small_number(3));
    request.mutable_symmetry()->set_mode(static_cast<v1::SetSymmetry::Mode>(test::in_range(0, 3)));
    request.mutable_symmetry()->mutable_plane()->mutable_normal()->set_x(1);
    for (int i = 0; i < 20; ++i) *request.add_points() = any_point();
    sequence.push_back(made);
  }
  for (int i = test::in_range(1, longest_sequence - 1); i > 0; --i) sequence.push_back(any_operation());
  return sequence;
}

// --- what holds of every document

std::string broken_link(const Document& document, const DualShape& shape) {
  if (shape.linked_from > shape.points.size()) return "mirrored from beyond the points";
  if (shape.symmetry == SymmetryMode::off) return shape.partner.empty() ? "" : "a partner without symmetry";
  if (std::abs(shape.plane.normal.norm() - 1) > 1e-12) return "a mirror plane without a unit normal";
  const DualShape* other = &shape;
  DualPtr partner;
  if (shape.symmetry == SymmetryMode::partner) {
    if (shape.partner.empty()) return "";
    partner = document.find_dual(shape.partner);
    if (!partner) return "a partner that is not there";
    other = partner.get();
    if (other->partner != shape.id || other->symmetry != SymmetryMode::partner) return "a partner of another";
    if (other->plane.normal != shape.plane.normal || other->plane.origin != shape.plane.origin) {
      return "partners with two planes";
    }
  }
  for (std::size_t i = 0; i < shape.points.size(); ++i) {
    const std::uint32_t image = shape.mirror_partner(i);
    if (image == DualPoint::no_partner) continue;
    if (image >= other->points.size()) return "an image beyond the points";
    if (other->mirror_partner(image) != i) return "an image of another point";
    const geometry::Vec3 place = shape.points[i].position();
    const geometry::Vec3 error =
        geometry::reflect_point(place, shape.plane) - other->points[image].position();
    // Sixty operations, each with rounding of the size of the workspace.
    if (!(error.norm() <= 1e-11 * (1 + place.norm() + shape.plane.origin.norm()))) {
      return "an image that is not the mirror image";
    }
    if (other->points[image].pressure != shape.points[i].pressure) return "an image of another weight";
  }
  return "";
}

/// The surface of a current fit is the optimum of its points (A8): with a_k the column sqrt(theta) u^i v^j of
/// the design and r the residuals, sqrt(theta) r is orthogonal to a_k for i + j <= N. Three errors are
/// allowed. Residual matching takes changes of r by 1e-12 of the heights z for rounding (settle() in
/// profile_edit.cpp). Householder QR is stable column by column (Higham, Accuracy and Stability,
/// theorem 20.3): what it finds is the optimum of columns that are off by n p eps of their length, and so is
/// each value f(x, y) = sum c_k a_k. An ill-conditioned design has large coefficients that cancel: the second
/// error scales with it.
std::string broken_optimum(const DualShape& shape) {
  const FittedSurface& fit = *shape.fit;
  const geometry::Box2& box = fit.surface.box();
  const auto scaled_coefficients = fit.surface.scaled_coefficients();
  const std::size_t p = scaled_coefficients.size();
  std::vector<double> gradient(p, 0.0);
  std::vector<double> length(p, 0.0);
  std::vector<double> row(p);
  double heights = 0;
  double displacements = 0;
  const double eps = std::numeric_limits<double>::epsilon();
  for (std::size_t i = 0; i < shape.points.size(); ++i) {
    const double theta = shape.points[i].pressure;
    const geometry::Vec3 at = fit.frame.to_local(shape.points[i].position());
    const geometry::Vec2 uv = (at.head<2>() - box.centre).cwiseQuotient(box.half_extent);
    geometry::evaluate_monomials(fit.surface.degree(), uv.x(), uv.y(), row.data());
    for (std::size_t k = 0; theta > 0 && k < p; ++k) {
      gradient[k] += theta * fit.residuals_m[i] * row[k];
      length[k] += theta * row[k] * row[k];
    }
    heights += theta * at.z() * at.z();
    const double rounding =
        longest_sequence * eps * (shape.points[i].position().norm() + fit.frame.origin.norm());
    const double turned = 1 + fit.surface.gradient(at.x(), at.y()).norm() +
                          fit.surface.degree() * std::abs(fit.residuals_m[i]) / box.half_extent.minCoeff();
    displacements += theta * rounding * rounding * turned * turned;
  }
  double summands = 0;  // Of f, before they cancel.
  for (std::size_t k = 0; k < p; ++k) {
    length[k] = std::sqrt(length[k]);
    summands += length[k] * std::abs(scaled_coefficients[k]);
  }
  heights = std::sqrt(heights);
  constexpr double matching = 1e-12;
  const double rounding = static_cast<double>(shape.points.size() * p) * eps;
  for (std::size_t k = 0; k < p; ++k) {
    const double allowed =
        length[k] * (matching * heights + rounding * (heights + summands) + std::sqrt(displacements));
    if (!(std::abs(gradient[k]) <= allowed)) {
      return fmt::format("a current fit that is not the optimum: gradient {} of coefficient {}, allowed {}",
                         gradient[k], k, allowed);
    }
  }
  return "";
}

std::string broken_fit(const DualShape& shape) {
  const FittedSurface& fit = *shape.fit;
  const geometry::Mat3& r = fit.frame.rotation;
  if (!fit.frame.origin.allFinite() || !r.allFinite()) return "a frame of no numbers";
  if ((r.transpose() * r - geometry::Mat3::Identity()).cwiseAbs().maxCoeff() > 1e-12 || r.determinant() < 0) {
    return "a frame that is not orthonormal and right-handed";
  }
  for (const double c : fit.surface.coefficients()) {
    if (!std::isfinite(c)) return "a coefficient that is no number";
  }
  for (const double residual : fit.residuals_m) {
    if (!std::isfinite(residual)) return "a residual that is no number";
  }
  if (!std::isfinite(fit.statistics.rms) || !std::isfinite(fit.statistics.max))
    return "statistics of no numbers";
  if (!(fit.box.half_extent.minCoeff() >= 0) || !fit.box.half_extent.allFinite())
    return "a box without extent";
  if (!(fit.frame_drift_rad >= 0 && fit.frame_drift_rad <= 1.6)) return "a drift that is no angle";
  if (fit.surface.degree() > static_cast<int>(fit.requested_degree)) return "a degree above the wanted one";
  if (fit.residuals_m.size() > shape.points.size()) return "residuals of points that are gone";
  if (shape.stale) return "";
  if (fit.residuals_m.size() != shape.points.size()) return "a current fit without all residuals";
  for (std::size_t i = 0; i < shape.points.size(); ++i) {
    const geometry::Vec3 p = fit.frame.to_local(shape.points[i].position());
    const double r_now = p.z() - fit.surface.value(p.x(), p.y());
    const double steepness = 1 + fit.surface.gradient(p.x(), p.y()).norm();
    const double error = std::abs(r_now - fit.residuals_m[i]);
    if (!(error <= 1e-9 * (1 + p.norm()) * steepness)) {
      return fmt::format(
          "a residual that is not the point's: {} instead of {}, slope {}, degree {}, point {} of {}",
          fit.residuals_m[i], r_now, steepness, fit.surface.degree(), i, shape.points.size());
    }
  }
  return broken_optimum(shape);
}

std::string broken_shape(const Document& document, const DualShape& shape, const Limits& limits) {
  for (const DualPoint& point : shape.points) {
    if (!point.position().allFinite()) return "a point of no numbers";
    if (point.position().cwiseAbs().maxCoeff() > limits.max_coordinate_m * 10)
      return "a point out of the world";
    if (!(point.pressure >= 0 && point.pressure <= 1)) return "a weight outside of 0..1";
    if (point.stroke == 0 || point.stroke > shape.stroke_count) return "a point of no stroke";
  }
  if (shape.requested_degree < 1 || shape.requested_degree > limits.max_degree)
    return "a degree outside of 1..6";
  if (!(shape.superellipse_exponent >= limits.min_superellipse_exponent &&
        shape.superellipse_exponent <= limits.max_superellipse_exponent)) {
    return "an exponent out of range";
  }
  if (!shape.fit && shape.stale) return "stale without a fit";
  if (!shape.fit && shape.representation == Representation::surface) return "shown as a surface it has not";
  if (shape.fit) {
    if (const std::string broken = broken_fit(shape); !broken.empty()) return broken;
  }
  return broken_link(document, shape);
}

/// What is wrong with the document, or nothing.
std::string broken_invariant(const Document& document, const Limits& limits) {
  if (document.present >= document.alternatives->size()) return "no present alternative";
  for (std::size_t i = 0; i < document.alternatives->size(); ++i) {
    const bool kept = (*document.alternatives)[i].entities != nullptr;
    if (kept == (i == document.present)) return "not exactly the present alternative without kept entities";
  }
  for (const auto& [id, entity] : document.entities) {
    if (!entity || entity->id != id) return id + ": under another id";
    if (!document.used_ids->contains(id)) return id + ": an id that was never given";
    if (const DualPtr shape = as_dual(entity)) {
      const std::string broken = broken_shape(document, *shape, limits);
      if (!broken.empty()) return fmt::format("{}: {}", id, broken);
    }
  }
  return "";
}

TEST(OperationSequences, A28X5KeepEveryInvariantAndUndoToTheBit) {
  std::map<std::string, int> applied;
  int sequences = 0;
  std::size_t longest = 0;
  EXPECT_TRUE(rc::check([&] {
    for (int round = 0; round < sequences_per_case; ++round) {
      Model model;
      v1::Operation undo;
      undo.mutable_undo();
      // The hashes on the way from the empty document to the present one.
      std::vector<std::string> path{document_hash(model.document())};
      std::vector<std::string> undone;
      const std::vector<Made> sequence = any_sequence();
      ++sequences;
      longest = std::max(longest, sequence.size());
      for (const Made& made : sequence) {
        const auto submitted = model.submit(made.operation);
        const std::string hash = document_hash(model.document());
        if (!submitted || submitted->sequence == 0) {
          RC_ASSERT(hash == path.back());
          continue;
        }
        ++applied[made.name];
        const std::string broken = broken_invariant(model.document(), model.limits());
        if (!broken.empty()) RC_FAIL(std::string(made.name) + " left " + broken);
        if (made.operation.has_undo()) {
          undone.push_back(path.back());
          path.pop_back();
          RC_ASSERT(hash == path.back());
        } else if (made.operation.has_redo()) {
          RC_ASSERT(hash == undone.back());
          path.push_back(undone.back());
          undone.pop_back();
        } else {
          path.push_back(hash);
          undone.clear();
        }
      }
      while (path.size() > 1) {
        RC_ASSERT(model.submit(undo).ok());
        path.pop_back();
        RC_ASSERT(document_hash(model.document()) == path.back());
      }
      RC_ASSERT(!model.submit(undo).ok());
    }
  }));
  // The sequences must reach what they are meant to reach.
  EXPECT_GE(sequences, cases * sequences_per_case);
  EXPECT_GE(longest, static_cast<std::size_t>(longest_sequence - 4));
  for (const Maker& maker : makers) EXPECT_GT(applied[maker.name], 2 * sequences_per_case) << maker.name;
}

}  // namespace
}  // namespace handloft::model
