// Invariants over random sequences of operations: A28 (undo and redo restore every bit), A12 (mirror twice is
// the identity), X2 (replay), X5 (no NaN), refusals change nothing.

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "any_operation.h"
#include "server-model/geometry/symmetry.h"
#include "server-model/model/canonical.h"
#include "server-model/model/model.h"

namespace handloft::model {
namespace {

namespace v1 = handloft::v1;

constexpr int bad_one_in = 60;  // Numbers that must be refused.

std::string any_id() {
  return *rc::gen::element<std::string>("a", "b", "a-mirror", "b-mirror", "shape-1", "shape-2");
}

v1::SetSymmetry any_symmetry(const std::string& id) {
  v1::SetSymmetry symmetry;
  symmetry.set_entity(id);
  symmetry.set_mode(static_cast<v1::SetSymmetry::Mode>(test::in_range(0, 3)));
  *symmetry.mutable_plane()->mutable_origin() = test::any_vector(bad_one_in);
  *symmetry.mutable_plane()->mutable_normal() = test::any_vector(bad_one_in);
  return symmetry;
}

// Curves of two points and more, for somebody, nobody or divided.
v1::ModifyProfile any_profile() {
  v1::ModifyProfile request;
  request.set_keep_as_points(test::in_range(0, 3) == 0);
  const int curves = test::in_range(0, 4);
  for (int i = 0; i < curves; ++i) {
    auto& curve = *request.add_curves();
    const int points = test::in_range(2, 8);
    for (int k = 0; k < points; ++k) {
      *curve.add_points()->mutable_position() = test::any_vector(bad_one_in);
      curve.mutable_points(k)->set_pressure(0.1 * test::in_range(0, 11));
    }
    if (test::in_range(0, 2) == 0) {
      curve.set_entity(any_id());
    } else if (test::in_range(0, 4) == 0) {
      curve.add_split_at(0.1 * test::in_range(0, 11));
      curve.add_split_entities(any_id());
      curve.add_split_entities(*rc::gen::element(any_id(), std::string("")));
    }
  }
  if (test::in_range(0, 4) == 0) request.add_entities(any_id());
  return request;
}

v1::Operation any_operation() {
  v1::Operation operation;
  const std::string id = any_id();
  switch (test::in_range(0, 17)) {
    case 0:
    case 1:
      operation.mutable_create_dual_shape()->set_id(*rc::gen::element(id, std::string("")));
      operation.mutable_create_dual_shape()->set_degree(static_cast<std::uint32_t>(test::in_range(0, 8)));
      break;
    case 2:
      *operation.mutable_set_symmetry() = any_symmetry(id);
      break;
    case 3:
    case 4:
      operation.mutable_fit()->set_entity(id);
      operation.mutable_fit()->set_degree(static_cast<std::uint32_t>(test::in_range(0, 7)));
      break;
    case 5:
      operation.mutable_refit_plane()->set_entity(id);
      break;
    case 6:
      operation.mutable_set_superellipse()->set_entity(id);
      operation.mutable_set_superellipse()->set_exponent(0.1 * test::in_range(0, 220));
      break;
    case 7:
      operation.mutable_set_representation()->set_entity(id);
      operation.mutable_set_representation()->set_representation(
          static_cast<v1::Representation>(test::in_range(0, 4)));
      break;
    case 8:
      operation.mutable_rename()->set_entity(id);
      operation.mutable_rename()->set_name(*rc::gen::element<std::string>("x", "y", ""));
      break;
    case 9:
      operation.mutable_delete_()->set_entity(id);
      break;
    case 10:
      operation.mutable_undo();
      break;
    case 11:
      operation.mutable_redo();
      break;
    case 12:
      *operation.mutable_modify_profile() = any_profile();
      break;
    default: {
      auto& request = *operation.mutable_add_points();
      request.set_entity(id);
      request.set_stroke(static_cast<std::uint32_t>(test::in_range(0, 4) % 3));
      request.set_min_spacing_m(0.01 * test::in_range(0, 3));
      if (test::in_range(0, 4) == 0) request.mutable_create();
      if (test::in_range(0, 8) == 0) *request.mutable_symmetry() = any_symmetry(id);
      const int count = test::in_range(0, 12);
      for (int i = 0; i < count; ++i) {
        auto& point = *request.add_points();
        *point.mutable_position() = test::any_vector(bad_one_in);
        point.set_pressure(0.1 * test::in_range(0, 11));
      }
    }
  }
  return operation;
}

std::vector<v1::Operation> any_operations() {
  const int count = test::in_range(1, 40);
  std::vector<v1::Operation> operations;
  // Something to work on, or most operations would only learn that there is no such entity.
  for (const char* id : {"a", "b"}) {
    operations.emplace_back().mutable_create_dual_shape()->set_id(id);
    auto& symmetry = *operations.emplace_back().mutable_set_symmetry();
    symmetry.set_entity(id);
    symmetry.set_mode(
        static_cast<v1::SetSymmetry::Mode>(std::min(test::in_range(0, 4), 2)));  // Often linked.
    symmetry.mutable_plane()->mutable_normal()->set_x(1);
  }
  for (int i = 0; i < count; ++i) operations.push_back(any_operation());
  return operations;
}

std::string hash(const Model& model) {
  return document_hash(model.document());
}

bool all_finite(const Document& document) {
  for (const auto& [id, entity] : document.entities) {
    const DualPtr shape = as_dual(entity);
    if (!shape) continue;
    for (const DualPoint& point : shape->points) {
      if (!point.position().allFinite() || !(point.pressure >= 0 && point.pressure <= 1)) return false;
    }
    if (!shape->fit) continue;
    const FittedSurface& fit = *shape->fit;
    if (!fit.frame.origin.allFinite() || !fit.frame.rotation.allFinite()) return false;
    for (const double coefficient : fit.surface.coefficients()) {
      if (!std::isfinite(coefficient)) return false;
    }
    for (const double residual : fit.residuals_m) {
      if (!std::isfinite(residual)) return false;
    }
  }
  return true;
}

TEST(ModelProperties, A28UndoAllIsTheBeginningAndRedoAllTheEnd) {
  EXPECT_TRUE(rc::check([] {
    Model model;
    const std::string start = hash(model);
    for (const auto& operation : any_operations()) (void)model.submit(operation).ok();
    v1::Operation redo;
    redo.mutable_redo();
    while (model.submit(redo).ok()) {
    }
    const std::string end = hash(model);
    std::vector<std::string> hashes{end};
    v1::Operation undo;
    undo.mutable_undo();
    while (model.submit(undo).ok()) hashes.push_back(hash(model));
    RC_ASSERT(hashes.back() == start);
    for (std::size_t i = hashes.size() - 1; i-- > 0;) {
      RC_ASSERT(model.submit(redo).ok());
      RC_ASSERT(hash(model) == hashes[i]);
    }
    RC_ASSERT(hash(model) == end);
  }));
}

TEST(ModelProperties, ARefusalChangesNothingAndNothingIsEverNaN) {
  // The sequences must reach what they are meant to reach.
  int applied = 0;
  int refused = 0;
  int fitted = 0;
  EXPECT_TRUE(rc::check([&] {
    Model model;
    for (const auto& operation : any_operations()) {
      const std::string before = hash(model);
      const auto sequence = model.sequence();
      const auto submitted = model.submit(operation);
      if (!submitted || submitted->sequence == 0) {
        RC_ASSERT(hash(model) == before);
        RC_ASSERT(model.sequence() == sequence);
      } else {
        RC_ASSERT(all_finite(model.document()));
        ++applied;
      }
      if (!submitted) ++refused;
      if (submitted && submitted->sequence != 0 && operation.has_fit()) ++fitted;
    }
  }));
  EXPECT_GT(applied, 300);
  EXPECT_GT(refused, 300);
  EXPECT_GT(fitted, 10);
}

TEST(ModelProperties, X2ReplayingTheLogGivesTheSameHash) {
  EXPECT_TRUE(rc::check([] {
    Model model;
    std::vector<v1::Operation> log;
    for (const auto& operation : any_operations()) {
      const auto submitted = model.submit(operation);
      if (submitted && submitted->sequence != 0) log.push_back(submitted->effective);
    }
    Model replayed;
    for (const auto& operation : log) RC_ASSERT(replayed.submit(operation).ok());
    RC_ASSERT(hash(replayed) == hash(model));
  }));
}

TEST(ModelProperties, LinkedPartnersStayPartners) {
  int links = 0;
  EXPECT_TRUE(rc::check([&] {
    Model model;
    for (const auto& operation : any_operations()) (void)model.submit(operation).ok();
    for (const auto& [id, entity] : model.document().entities) {
      const DualPtr shape = as_dual(entity);
      if (!shape || shape->partner.empty()) continue;
      ++links;
      const DualPtr partner = model.document().find_dual(shape->partner);
      RC_ASSERT(static_cast<bool>(partner));
      RC_ASSERT(partner->partner == id);
      RC_ASSERT(shape->symmetry == SymmetryMode::partner);
      RC_ASSERT(partner->plane.normal == shape->plane.normal);
      for (std::size_t i = 0; i < shape->points.size(); ++i) {
        const std::uint32_t image = shape->mirror_partner(i);
        if (image == DualPoint::no_partner) continue;
        RC_ASSERT(image < partner->points.size());
        RC_ASSERT(partner->mirror_partner(image) == i);
        // A12: the one is the mirror image of the other, and mirroring twice is the identity.
        const geometry::Vec3 mirrored = geometry::reflect_point(shape->points[i].position(), shape->plane);
        const double size = 1.0 + shape->points[i].position().norm() + shape->plane.origin.norm();
        RC_ASSERT((mirrored - partner->points[image].position()).norm() <= 1e-14 * size);
      }
    }
  }));
  EXPECT_GT(links, 10);
}

TEST(ModelProperties, AGestureInPiecesEqualsTheWhole) {
  EXPECT_TRUE(rc::check([] {
    Model model;
    for (const auto& operation : any_operations()) (void)model.submit(operation).ok();
    v1::Operation whole;
    auto& request = *whole.mutable_add_points();
    request.set_entity(any_id());
    request.set_min_spacing_m(0.01 * test::in_range(0, 3));
    RC_PRE(static_cast<bool>(model.document().find(request.entity())));
    auto gesture = model.begin_provisional(whole);
    RC_ASSERT(gesture.ok());
    const int count = test::in_range(0, 30);
    for (int i = 0; i < count; ++i) {
      v1::Point point;
      *point.mutable_position() = test::any_vector(bad_one_in);
      if (model.append_provisional(*gesture, std::vector<v1::Point>{point}).ok())
        *request.add_points() = point;
    }
    const std::string preview = document_hash(model.preview());
    const auto applied = apply(model.document(), whole);
    RC_ASSERT(applied.ok());
    RC_ASSERT(document_hash(applied->document) == preview);
    RC_ASSERT(model.commit_provisional(*gesture).ok());
    RC_ASSERT(hash(model) == preview);
  }));
}

}  // namespace
}  // namespace handloft::model
