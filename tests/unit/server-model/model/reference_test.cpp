// A28: reference meshes as entities, and how far shapes are from them.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "server-model/model/canonical.h"
#include "server-model/model/model.h"
#include "server-model/model/reference_shape.h"

namespace handloft::model {
namespace {

namespace v1 = handloft::v1;

/// A square of side 2 in the plane z = `height`, facing up.
v1::Operation plate(const std::string& id, float height = 0.0F) {
  v1::Operation operation;
  v1::ImportReference& reference = *operation.mutable_import_reference();
  reference.set_id(id);
  for (const auto& [x, y] : {std::pair{-1.0F, -1.0F}, {1.0F, -1.0F}, {1.0F, 1.0F}, {-1.0F, 1.0F}}) {
    for (const float value : {x, y, height}) reference.mutable_resolved()->add_positions(value);
  }
  for (const unsigned index : {0U, 1U, 2U, 0U, 2U, 3U}) reference.mutable_resolved()->add_indices(index);
  return operation;
}

/// A shape of 5 x 5 points at the height z, fitted.
void lay(Model& model, const std::string& id, double z) {
  v1::Operation operation;
  operation.mutable_add_points()->set_entity(id);
  operation.mutable_add_points()->mutable_create();
  for (int i = 0; i < 25; ++i) {
    v1::Point& point = *operation.mutable_add_points()->add_points();
    point.mutable_position()->set_x(0.02 * (i % 5) - 0.04);
    point.mutable_position()->set_y(0.015 * (i / 5) - 0.03);
    point.mutable_position()->set_z(z);
    point.set_pressure(1.0);
  }
  ASSERT_TRUE(model.submit(operation).ok());
  v1::Operation fit;
  fit.mutable_fit()->set_entity(id);
  fit.mutable_fit()->set_degree(1);
  ASSERT_TRUE(model.submit(fit).ok());
}

std::string field_of(Model& model, const v1::Operation& operation) {
  const auto result = model.submit(operation);
  return result ? std::string("accepted") : result.error().field;
}

TEST(ReferenceModel, A28_ImportedUndoneAndReplayedAlike) {
  Model model;
  const std::string before = document_hash(model.document());
  const auto submitted = model.submit(plate(""));
  ASSERT_TRUE(submitted.ok()) << submitted.error().describe();
  EXPECT_EQ(submitted->words, "Import reference \"reference-1\" of 2 triangles");
  EXPECT_EQ(submitted->effective.import_reference().id(), "reference-1");
  const std::string after = document_hash(model.document());
  EXPECT_NE(after, before);
  const ReferencePtr reference = as_reference(model.document().find("reference-1"));
  ASSERT_TRUE(reference);
  EXPECT_EQ(reference->mesh->triangles.size(), 2U);
  v1::Operation undo;
  undo.mutable_undo();
  ASSERT_TRUE(model.submit(undo).ok());
  EXPECT_EQ(document_hash(model.document()), before);
  Model again;
  ASSERT_TRUE(again.submit(submitted->effective).ok());
  EXPECT_EQ(document_hash(again.document()), after);
}

TEST(ReferenceModel, A28_DistanceOfPointsAndSurfaceIsSigned) {
  Model model;
  ASSERT_TRUE(model.submit(plate("table")).ok());
  lay(model, "above", 0.05);
  lay(model, "below", -0.02);
  for (const auto& [id, z] : {std::pair{"above", 0.05}, {"below", -0.02}}) {
    for (const char* reference : {"table", ""}) {
      v1::Query query;
      query.mutable_distance()->set_entity(id);
      query.mutable_distance()->set_reference(reference);
      const auto result = model.query(query);
      ASSERT_TRUE(result.ok()) << result.error().describe();
      const v1::DistanceResult& distance = result->distance();
      EXPECT_EQ(distance.points().count(), 25U);
      EXPECT_NEAR(distance.points().mean_m(), z, 1e-12);
      EXPECT_NEAR(distance.points().rms_m(), std::abs(z), 1e-12);
      EXPECT_NEAR(distance.points().max_m(), std::abs(z), 1e-12);
      EXPECT_GT(distance.surface().count(), 20U);
      EXPECT_NEAR(distance.surface().mean_m(), z, 1e-9);
    }
  }
}

TEST(ReferenceModel, A28_DistanceSaysWhatIsMissing) {
  Model model;
  lay(model, "shape", 0.05);
  const auto ask = [&](const std::string& entity, const std::string& reference) {
    v1::Query query;
    query.mutable_distance()->set_entity(entity);
    query.mutable_distance()->set_reference(reference);
    const auto result = model.query(query);
    return result ? std::string("answered") : result.error().describe();
  };
  EXPECT_EQ(ask("shape", ""),
            "failed_precondition: distance.reference: there are 0 references, expected the name of one");
  ASSERT_TRUE(model.submit(plate("a")).ok());
  EXPECT_EQ(ask("shape", ""), "answered");
  ASSERT_TRUE(model.submit(plate("b", 0.1F)).ok());
  EXPECT_EQ(ask("shape", ""),
            "failed_precondition: distance.reference: there are 2 references, expected the name of one");
  EXPECT_EQ(ask("shape", "shape"),
            "invalid_argument: distance.reference: \"shape\" is no reference, expected one");
  EXPECT_NE(ask("a", "b").find("distance.entity"), std::string::npos);
  EXPECT_NE(ask("shape", "c").find("not_found: distance.reference"), std::string::npos);
}

TEST(ReferenceModel, BadMeshesAreRefusedWithTheirField) {
  Model model;
  v1::Operation operation;
  operation.mutable_import_reference()->set_path("mouse.obj");
  EXPECT_EQ(field_of(model, operation), "import_reference.resolved");  // Not read yet.
  operation = plate("a");
  operation.mutable_import_reference()->set_scale(2);
  EXPECT_EQ(field_of(model, operation), "import_reference.resolved");
  operation = plate("a");
  operation.mutable_import_reference()->mutable_resolved()->set_indices(4, 4);
  EXPECT_EQ(field_of(model, operation), "import_reference.resolved.indices[4]");
  operation = plate("a");
  operation.mutable_import_reference()->mutable_resolved()->set_positions(
      7, std::numeric_limits<float>::quiet_NaN());
  EXPECT_EQ(field_of(model, operation), "import_reference.resolved.positions[7]");
  operation.mutable_import_reference()->mutable_resolved()->set_positions(7, 1e6F);
  EXPECT_EQ(field_of(model, operation), "import_reference.resolved.positions[7]");
  operation = plate("a");
  operation.mutable_import_reference()->mutable_resolved()->add_positions(1.0F);
  EXPECT_EQ(field_of(model, operation), "import_reference.resolved");
  operation = plate("a");
  operation.mutable_import_reference()->mutable_resolved()->clear_indices();
  EXPECT_EQ(field_of(model, operation), "import_reference.resolved");
  for (const unsigned index : {0U, 1U, 1U})
    operation.mutable_import_reference()->mutable_resolved()->add_indices(index);
  EXPECT_EQ(field_of(model, operation), "import_reference.resolved.indices");  // No area.
  EXPECT_EQ(field_of(model, plate("bad id")), "import_reference.id");
  EXPECT_EQ(field_of(model, plate("a")), "accepted");
  EXPECT_EQ(field_of(model, plate("a")), "import_reference.id");
  EXPECT_EQ(model.document().entities.size(), 1U);
}

}  // namespace
}  // namespace handloft::model
