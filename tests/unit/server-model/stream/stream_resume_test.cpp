// Resuming (U3, C3): a viewer that lost its connection at any moment says what it holds, is sent what
// differs, and shows then what one shows that has just come.

#include <gmock/gmock.h>

#include <cmath>
#include <cstdlib>
#include <functional>
#include <map>
#include <random>
#include <string>

#include "common/codec/mesh_codec.h"
#include "common/codec/point_codec.h"
#include "server-model/model/model.h"
#include "server-model/stream/scene_builder.h"
#include "server-model/stream/viewer.h"

namespace handloft::stream {
namespace {

/// A client's mirror, by the words of PROTOCOL.md.
struct Mirror {
  struct Entity {
    v1::EntityState state;  ///< Without points, surface, curves and icons.
    codec::PointTail points;
    std::string surface, curves, icons;
    std::uint64_t surface_id = 0;
  };
  std::map<std::string, Entity> entities;
  std::uint64_t epoch = 0;
  std::uint64_t sequence = 0;
  std::string notes;  ///< Comments and versions.
  std::size_t bytes = 0;

  void take(const v1::EntityState& state) {
    Entity& entity = entities[state.id()];
    if (state.has_points()) {
      const auto tail = codec::decode_points(state.points());
      ASSERT_TRUE(tail.ok()) << tail.error().describe();
      ASSERT_TRUE(codec::merge_points(entity.points, *tail).ok());
    }
    if (!state.surface_shown()) {
      entity.surface.clear();
      entity.surface_id = 0;
    } else if (state.has_surface()) {
      entity.surface = state.surface().SerializeAsString();
      entity.surface_id = state.surface_id();
    }
    v1::EntityState part;
    if (state.curves_shown()) {
      *part.mutable_curves() = state.curves();
      entity.curves = part.SerializeAsString();
    }
    part.Clear();
    if (state.icons_shown()) {
      *part.mutable_icons() = state.icons();
      entity.icons = part.SerializeAsString();
    }
    entity.state = state;
    entity.state.clear_points();
    entity.state.clear_surface();
    entity.state.clear_surface_id();
    entity.state.clear_curves();
    entity.state.clear_curves_shown();
    entity.state.clear_icons();
    entity.state.clear_icons_shown();
  }
  void take(const v1::Envelope& envelope) {
    bytes += envelope.ByteSizeLong();
    if (envelope.has_snapshot()) {
      entities.clear();
      epoch = envelope.snapshot().epoch();
      sequence = envelope.snapshot().sequence();
      for (const auto& state : envelope.snapshot().entities()) take(state);
      notes = envelope.snapshot().comments().SerializeAsString();
      return;
    }
    sequence = envelope.delta().sequence();
    for (const auto& id : envelope.delta().removed()) entities.erase(id);
    for (const auto& state : envelope.delta().changed()) take(state);
    if (envelope.delta().has_comments()) notes = envelope.delta().comments().SerializeAsString();
  }
  v1::Join join() const {
    v1::Join join;
    join.set_epoch(epoch);
    for (const auto& [id, entity] : entities) {
      v1::HeldEntity& have = *join.add_have();
      have.set_id(id);
      have.set_revision(entity.state.revision());
      have.set_points(entity.points.total);
      have.set_surface_id(entity.surface_id);
    }
    return join;
  }
};

void expect_same(const Mirror& a, const Mirror& b) {
  EXPECT_EQ(a.sequence, b.sequence);
  EXPECT_EQ(a.notes, b.notes);
  ASSERT_EQ(a.entities.size(), b.entities.size());
  for (const auto& [id, left] : a.entities) {
    const auto found = b.entities.find(id);
    ASSERT_NE(found, b.entities.end()) << id;
    const Mirror::Entity& right = found->second;
    EXPECT_EQ(left.state.SerializeAsString(), right.state.SerializeAsString()) << left.state.DebugString();
    EXPECT_EQ(left.surface, right.surface) << id;
    EXPECT_EQ(left.curves, right.curves) << id;
    EXPECT_EQ(left.icons, right.icons) << id;
    ASSERT_EQ(left.points.positions, right.points.positions) << id;
    for (std::size_t i = 0; i < left.points.styles.size(); ++i) {
      ASSERT_EQ(left.points.palette[left.points.styles[i]], right.points.palette[right.points.styles[i]]);
    }
  }
}

/// What people do to a few shapes, at random.
class Work {
 public:
  explicit Work(std::uint64_t seed) : random_(seed) {}

  void step(model::Model& model) {
    v1::Operation operation;
    const std::string id = "s" + std::to_string(below(4));
    switch (below(10)) {
      case 0:
        operation.mutable_delete_()->set_entity(id);
        break;
      case 1:
        operation.mutable_fit()->set_entity(id);
        break;
      case 2:
        operation.mutable_undo();
        break;
      case 3:
        operation.mutable_redo();
        break;
      case 4:
        operation.mutable_rename()->set_entity(id);
        operation.mutable_rename()->set_name("n" + std::to_string(below(3)));
        break;
      case 5:
        operation.mutable_transform()->add_entities(id);
        operation.mutable_transform()->mutable_translation()->set_x(0.01);
        break;
      case 6:
        operation.mutable_add_comment()->set_text("hm");
        operation.mutable_add_comment()->mutable_place()->set_z(0.1);
        break;
      case 7:
        operation.mutable_delete_points()->set_entity(id);
        operation.mutable_delete_points()->mutable_region()->mutable_sphere()->set_radius_m(
            below(2) == 0 ? 10 : 0.05);
        operation.mutable_delete_points()->mutable_region()->mutable_sphere()->mutable_centre();
        break;
      default:
        add(model, operation, id);
        break;
    }
    (void)model.submit(operation);  // Refused or not.
  }
  std::uint64_t below(std::uint64_t limit) { return random_() % limit; }

 private:
  void add(const model::Model& model, v1::Operation& operation, const std::string& id) {
    v1::AddPoints& add = *operation.mutable_add_points();
    const bool there = model.document().find(id) != nullptr;
    add.set_entity(there ? id : "s" + std::to_string(below(4)) + "x" + std::to_string(++made_));
    if (!there) {
      // Ids are not used again, so others take their places.
      add.mutable_create();
    }
    for (int i = 0; i < 30; ++i) {
      const double x = 0.04 * std::sin(0.7 * i) + 0.001 * static_cast<double>(below(10));
      const double y = 0.06 * std::cos(1.1 * i);
      v1::Point& point = *add.add_points();
      point.mutable_position()->set_x(x);
      point.mutable_position()->set_y(y);
      point.mutable_position()->set_z(0.1 + 3.0 * (x * x + y * y));
      point.set_pressure(0.5);
    }
  }

  std::mt19937_64 random_;
  int made_ = 0;
};

TEST(Resume, C3_a_cut_at_any_moment_leaves_what_one_sees_that_has_just_come) {
  const int runs = std::getenv("HANDLOFT_LONG") != nullptr ? 5'000 : 100;
  std::size_t resumed_bytes = 0;
  std::size_t snapshot_bytes = 0;
  int resumed = 0;
  for (int run = 0; run < runs; ++run) {
    SCOPED_TRACE(run);
    Work work(static_cast<std::uint64_t>(run));
    model::Model model;
    MeshCache meshes([](const std::function<void()>& job) { job(); }, [] {});
    SceneBuilder builder(7, meshes);
    // Small messages: a scene comes in several, and a cut comes between them as well.
    const ViewerLimits limits{.max_message_bytes = 3000, .max_points_per_message = 50};
    for (const char* id : {"s0", "s1", "s2", "s3"}) {
      v1::Operation operation;
      operation.mutable_create_dual_shape()->set_id(id);
      ASSERT_TRUE(model.submit(operation).ok());
    }
    Mirror mirror;
    Viewer viewer(limits);
    for (int cut = 0; cut < 4; ++cut) {
      for (std::uint64_t i = work.below(20); i > 0; --i) {
        work.step(model);
        const auto scene = builder.build(model, 0);
        for (std::uint64_t k = work.below(4); k > 0; --k) {
          if (const auto envelope = viewer.next(*scene)) mirror.take(*envelope);
        }
      }
      // The line is cut; what was sent last may not have come.
      if (work.below(2) == 0) (void)viewer.next(*builder.build(model, 0));
      for (std::uint64_t i = work.below(5); i > 0; --i) {
        work.step(model);
        (void)builder.build(model, 0);
      }
      const auto scene = builder.build(model, 0);
      viewer = Viewer(limits);
      const bool goes_on = viewer.resume(mirror.join(), *scene);
      EXPECT_EQ(goes_on, mirror.epoch != 0);
      const std::size_t before = mirror.bytes;
      while (const auto envelope = viewer.next(*scene)) mirror.take(*envelope);
      Mirror fresh;
      Viewer late(limits);
      while (const auto envelope = late.next(*scene)) fresh.take(*envelope);
      ASSERT_NO_FATAL_FAILURE(expect_same(mirror, fresh));
      if (goes_on) {
        ++resumed;
        resumed_bytes += mirror.bytes - before;
        snapshot_bytes += fresh.bytes;
      }
    }
  }
  RecordProperty("resumed", resumed);
  std::printf("%d resumed: %zu bytes each, a snapshot %zu\n", resumed,
              resumed_bytes / static_cast<std::size_t>(resumed),
              snapshot_bytes / static_cast<std::size_t>(resumed));
  EXPECT_LT(resumed_bytes, snapshot_bytes);
}

/// A cloud of 5,000 points that a mirror holds, then what happens to it while the mirror is away; gives the
/// bytes by which it catches up.
std::size_t bytes_to_catch_up(const std::function<void(model::Model&)>& meanwhile) {
  model::Model model;
  MeshCache meshes([](const std::function<void()>& job) { job(); }, [] {});
  SceneBuilder builder(7, meshes);
  const auto add = [&](int count) {
    v1::Operation operation;
    operation.mutable_add_points()->set_entity("a");
    if (model.document().find("a") == nullptr) operation.mutable_add_points()->mutable_create();
    for (int i = 0; i < count; ++i)
      operation.mutable_add_points()->add_points()->mutable_position()->set_x(1e-4 * i);
    EXPECT_TRUE(model.submit(operation).ok());
  };
  add(5000);
  Mirror mirror;
  Viewer viewer;
  const auto scene = builder.build(model, 0);
  while (const auto envelope = viewer.next(*scene)) mirror.take(*envelope);
  for (int i = 0; i < 10; ++i) {
    add(3);
    (void)builder.build(model, 0);
  }
  meanwhile(model);
  const auto later = builder.build(model, 0);
  viewer = Viewer();
  EXPECT_TRUE(viewer.resume(mirror.join(), *later));
  const std::size_t before = mirror.bytes;
  while (const auto envelope = viewer.next(*later)) mirror.take(*envelope);
  Mirror fresh;
  Viewer late;
  while (const auto envelope = late.next(*later)) fresh.take(*envelope);
  expect_same(mirror, fresh);
  return mirror.bytes - before;
}

TEST(Resume, U3_of_a_cloud_that_has_only_grown_the_tail_is_sent) {
  const std::size_t grown = bytes_to_catch_up([](model::Model&) {});
  EXPECT_LT(grown, 2000U) << "30 points of 14 bytes and what is told of every entity";
  const std::size_t named = bytes_to_catch_up([](model::Model& model) {
    v1::Operation operation;
    operation.mutable_rename()->set_entity("a");
    operation.mutable_rename()->set_name("seat");
    EXPECT_TRUE(model.submit(operation).ok());
  });
  EXPECT_LT(named, 2000U);
}

TEST(Resume, NegativeControl_of_a_cloud_that_was_moved_all_is_sent) {
  const std::size_t moved = bytes_to_catch_up([](model::Model& model) {
    v1::Operation operation;
    operation.mutable_transform()->add_entities("a");
    operation.mutable_transform()->mutable_translation()->set_x(0.01);
    EXPECT_TRUE(model.submit(operation).ok());
  });
  EXPECT_GT(moved, 5000U * 14);
}

TEST(Resume, what_a_join_claims_is_believed_only_as_far_as_it_can_be) {
  model::Model model;
  MeshCache meshes([](const std::function<void()>& job) { job(); }, [] {});
  SceneBuilder builder(7, meshes);
  Work work(1);
  for (int i = 0; i < 60; ++i) work.step(model);
  const auto scene = builder.build(model, 0);
  ASSERT_FALSE(scene->entities.empty());
  v1::Join lie;
  lie.set_epoch(7);
  for (const auto& [id, entity] : scene->entities) {
    v1::HeldEntity& have = *lie.add_have();
    have.set_id(id);
    have.set_revision(entity.revision);
    have.set_points(0xFFFFFFFFU);  // More than there are.
    have.set_surface_id(~std::uint64_t{0});
  }
  Viewer viewer;
  ASSERT_TRUE(viewer.resume(lie, *scene));
  Mirror mirror;
  while (const auto envelope = viewer.next(*scene)) mirror.take(*envelope);
  Mirror fresh;
  Viewer late;
  while (const auto envelope = late.next(*scene)) fresh.take(*envelope);
  expect_same(mirror, fresh);
  Viewer strict({.max_held = 1});
  lie.add_have();
  lie.add_have();
  EXPECT_FALSE(strict.resume(lie, *scene));
  EXPECT_TRUE(strict.next(*scene)->has_snapshot());
  lie.set_epoch(0);
  EXPECT_FALSE(viewer.resume(lie, *scene)) << "of no epoch nothing is held";
}

TEST(Resume, U4_what_only_a_stalled_viewer_keeps_is_counted) {
  model::Model model;
  MeshCache meshes([](const std::function<void()>& job) { job(); }, [] {});
  SceneBuilder builder(7, meshes);
  v1::Operation operation;
  operation.mutable_add_points()->set_entity("a");
  operation.mutable_add_points()->mutable_create();
  for (int i = 0; i < 1000; ++i)
    operation.mutable_add_points()->add_points()->mutable_position()->set_x(0.001 * i);
  ASSERT_TRUE(model.submit(operation).ok());
  Viewer viewer;
  const auto scene = builder.build(model, 0);
  while (viewer.next(*scene)) {
  }
  EXPECT_EQ(viewer.stale_bytes(*scene), 0U);
  v1::Operation moved;
  moved.mutable_transform()->add_entities("a");
  moved.mutable_transform()->mutable_translation()->set_x(1);
  ASSERT_TRUE(model.submit(moved).ok());
  const auto later = builder.build(model, 0);
  EXPECT_GE(viewer.stale_bytes(*later), 1000U * sizeof(model::DualPoint));
  viewer.reset();
  EXPECT_EQ(viewer.stale_bytes(*later), 0U);
}

}  // namespace
}  // namespace handloft::stream
