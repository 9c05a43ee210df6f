// A28: what viewers are sent of references, distances to them and alternatives.

#include <gtest/gtest.h>

#include <bit>
#include <cmath>

#include "common/codec/mesh_codec.h"
#include "server-model/model/model.h"
#include "server-model/stream/scene_builder.h"
#include "server-model/stream/viewer.h"

namespace handloft::stream {
namespace {

/// Jobs run at once, so that every build finds what it asked for.
class StreamReference : public ::testing::Test {
 protected:
  void submit(const v1::Operation& operation) {
    const auto result = model_.submit(operation);
    ASSERT_TRUE(result.ok()) << result.error().describe();
  }
  void lay(double height) {
    v1::Operation operation;
    operation.mutable_add_points()->set_entity("shape");
    operation.mutable_add_points()->mutable_create();
    for (int i = 0; i < 25; ++i) {
      v1::Point& point = *operation.mutable_add_points()->add_points();
      point.mutable_position()->set_x(0.02 * (i % 5) - 0.04);
      point.mutable_position()->set_y(0.015 * (i / 5) - 0.03);
      point.mutable_position()->set_z(height);
      point.set_pressure(1.0);
    }
    submit(operation);
    v1::Operation fit;
    fit.mutable_fit()->set_entity("shape");
    submit(fit);
  }
  void plate(const std::string& id, float height) {
    v1::Operation operation;
    operation.mutable_import_reference()->set_id(id);
    v1::TriangleMesh& mesh = *operation.mutable_import_reference()->mutable_resolved();
    for (const auto& [x, y] : {std::pair{-1.0F, -1.0F}, {1.0F, -1.0F}, {1.0F, 1.0F}, {-1.0F, 1.0F}}) {
      for (const float value : {x, y, height}) mesh.add_positions(value);
    }
    for (const unsigned index : {0U, 1U, 2U, 0U, 2U, 3U}) mesh.add_indices(index);
    submit(operation);
  }
  ScenePtr scene() { return builder_.build(model_, 0); }
  static const v1::EntityState* find(const google::protobuf::RepeatedPtrField<v1::EntityState>& states,
                                     const std::string& id) {
    for (const v1::EntityState& state : states) {
      if (state.id() == id) return &state;
    }
    return nullptr;
  }
  /// All vertices are this far from the reference.
  static void expect_distances(const v1::EntityState& state, double expected) {
    ASSERT_GT(state.surface().vertex_count(), 0U);
    ASSERT_EQ(state.distances().size(), 4U * state.surface().vertex_count());
    for (std::size_t i = 0; i < state.distances().size(); i += 4) {
      std::uint32_t bits = 0;
      for (std::size_t k = 0; k < 4; ++k) {
        bits |= std::uint32_t{static_cast<std::uint8_t>(state.distances()[i + k])} << (8U * k);
      }
      EXPECT_NEAR(static_cast<double>(std::bit_cast<float>(bits)), expected, 1e-5);
    }
  }

  model::Model model_;
  MeshCache meshes_{[](const std::function<void()>& job) { job(); }, [] {}};
  SceneBuilder builder_{1, meshes_};
  Viewer viewer_;
};

TEST_F(StreamReference, A28_AReferenceIsAnOpaqueSurfaceSentOnce) {
  plate("table", 0.0F);
  const auto first = viewer_.next(*scene());
  ASSERT_TRUE(first && first->has_snapshot());
  const v1::EntityState* const table = find(first->snapshot().entities(), "table");
  ASSERT_NE(table, nullptr);
  EXPECT_EQ(table->kind(), "reference");
  EXPECT_TRUE(table->surface_shown());
  EXPECT_FALSE(table->has_points());
  const auto mesh = codec::decode_mesh(table->surface());
  ASSERT_TRUE(mesh.ok());
  EXPECT_EQ(mesh->positions.size(), 4U);
  for (const std::uint8_t opacity : mesh->opacity) EXPECT_EQ(opacity, 255);
  for (const auto& normal : mesh->normals) EXPECT_GT(normal[2], 0.99F);
  EXPECT_FALSE(viewer_.next(*scene()));
}

TEST_F(StreamReference, A28_DistancesComeWithTheSurfaceWhileThereIsAReference) {
  lay(0.05);
  auto message = viewer_.next(*scene());
  ASSERT_TRUE(message && message->has_snapshot());
  EXPECT_EQ(message->snapshot().entities(0).distances(), "");
  plate("table", 0.0F);
  message = viewer_.next(*scene());
  ASSERT_TRUE(message && message->has_delta());
  const v1::EntityState* shape = find(message->delta().changed(), "shape");
  ASSERT_NE(shape, nullptr);
  expect_distances(*shape, 0.05);
  plate("ceiling", 0.06F);  // Nearer, and the shape is below it.
  message = viewer_.next(*scene());
  shape = find(message->delta().changed(), "shape");
  ASSERT_NE(shape, nullptr);
  expect_distances(*shape, -0.01);
  for (const char* id : {"table", "ceiling"}) {
    v1::Operation remove;
    remove.mutable_delete_()->set_entity(id);
    submit(remove);
  }
  message = viewer_.next(*scene());
  shape = find(message->delta().changed(), "shape");
  ASSERT_NE(shape, nullptr);
  EXPECT_EQ(shape->distances(), "");
  EXPECT_GT(shape->surface().vertex_count(), 0U);
  EXPECT_FALSE(viewer_.next(*scene()));
}

TEST_F(StreamReference, A28_AlternativesAreSentWhenTheyChange) {
  lay(0.05);
  auto message = viewer_.next(*scene());
  EXPECT_EQ(message->snapshot().alternatives().present(), "main");
  v1::Operation made;
  made.mutable_new_alternative()->set_name("longer");
  submit(made);
  plate("table", 0.0F);
  message = viewer_.next(*scene());
  ASSERT_TRUE(message->delta().has_alternatives());
  EXPECT_EQ(message->delta().alternatives().present(), "longer");
  EXPECT_EQ(message->delta().alternatives().names_size(), 2);
  v1::Operation back;
  back.mutable_switch_alternative()->set_name("main");
  submit(back);
  message = viewer_.next(*scene());
  ASSERT_TRUE(message && message->has_delta());
  EXPECT_EQ(message->delta().alternatives().present(), "main");
  ASSERT_EQ(message->delta().removed_size(), 1);
  EXPECT_EQ(message->delta().removed(0), "table");
  submit(back);  // Nothing changes.
  EXPECT_FALSE(viewer_.next(*scene()));
}

TEST(ReferenceCache, SupersededJobsAreDropped) {
  std::vector<std::function<void()>> jobs;
  int ready = 0;
  ReferenceCache cache([&](std::function<void()> job) { jobs.push_back(std::move(job)); }, [&] { ++ready; },
                       0);
  const auto reference = std::make_shared<model::ReferenceMesh>();
  cache.begin_round();
  EXPECT_EQ(cache.find_mesh(reference), nullptr);
  EXPECT_EQ(cache.find_mesh(reference), nullptr);
  cache.end_round();
  EXPECT_EQ(jobs.size(), 1U);
  cache.begin_round();  // Not asked for any more.
  cache.end_round();
  jobs[0]();
  EXPECT_EQ(ready, 0);
}

}  // namespace
}  // namespace handloft::stream
