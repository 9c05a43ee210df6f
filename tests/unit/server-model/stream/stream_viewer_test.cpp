// What viewers are sent (architecture idea 5): state, not events; the newest, not a backlog.

#include <gmock/gmock.h>

#include <random>

#include "common/codec/mesh_codec.h"
#include "common/codec/point_codec.h"
#include "server-model/model/model.h"
#include "server-model/stream/scene_builder.h"
#include "server-model/stream/viewer.h"

namespace handloft::stream {
namespace {

/// A client's mirror, as simple as can be.
struct Mirror {
  struct Entity {
    v1::EntityState state;
    codec::PointTail points;
    std::string mesh;
  };
  std::map<std::string, Entity> entities;
  std::uint64_t sequence = 0;
  std::size_t messages = 0;
  std::size_t bytes = 0;

  void take(const v1::EntityState& state) {
    Entity& entity = entities[state.id()];
    if (state.has_points()) {
      const auto tail = codec::decode_points(state.points());
      ASSERT_TRUE(tail.ok()) << tail.error().describe();
      const Status merged = codec::merge_points(entity.points, *tail);
      ASSERT_TRUE(merged.ok()) << merged.error().describe();
    }
    if (!state.surface_shown()) entity.mesh.clear();
    if (state.has_surface()) {
      ASSERT_TRUE(codec::decode_mesh(state.surface()).ok());
      entity.mesh = state.surface().SerializeAsString();
    }
    entity.state = state;
    entity.state.clear_points();
    entity.state.clear_surface();
  }
  void take(const v1::Envelope& envelope) {
    ++messages;
    bytes += envelope.ByteSizeLong();
    if (envelope.has_snapshot()) {
      entities.clear();
      sequence = envelope.snapshot().sequence();
      for (const auto& state : envelope.snapshot().entities()) take(state);
    } else {
      sequence = envelope.delta().sequence();
      for (const auto& id : envelope.delta().removed()) entities.erase(id);
      for (const auto& state : envelope.delta().changed()) take(state);
    }
  }
};

void expect_same(const Mirror& a, const Mirror& b) {
  ASSERT_EQ(a.entities.size(), b.entities.size());
  EXPECT_EQ(a.sequence, b.sequence);
  for (const auto& [id, left] : a.entities) {
    const auto found = b.entities.find(id);
    ASSERT_NE(found, b.entities.end()) << id;
    EXPECT_EQ(left.state.SerializeAsString(), found->second.state.SerializeAsString());
    EXPECT_EQ(left.mesh, found->second.mesh);
    EXPECT_EQ(left.points.positions, found->second.points.positions);
    for (std::size_t i = 0; i < left.points.styles.size(); ++i) {
      ASSERT_EQ(left.points.palette[left.points.styles[i]],
                found->second.points.palette[found->second.points.styles[i]]);
    }
  }
}

class ViewerTest : public ::testing::Test {
 protected:
  ScenePtr scene() { return builder_.build(model_, 42, {{"shape-1"}, {}, {}}); }
  static void catch_up(Viewer& viewer, Mirror& mirror, const Scene& scene) {
    while (const auto envelope = viewer.next(scene)) mirror.take(*envelope);
  }
  void create() {
    v1::Operation operation;
    operation.mutable_create_dual_shape();
    ASSERT_TRUE(model_.submit(operation).ok());
  }
  static std::vector<v1::Point> bowl(int count, double offset = 0.0) {
    std::vector<v1::Point> points;
    for (int i = 0; i < count; ++i) {
      const double x = 0.04 * std::sin(0.7 * i) + offset;
      const double y = 0.06 * std::cos(1.1 * i);
      v1::Point point;
      point.mutable_position()->set_x(x);
      point.mutable_position()->set_y(y);
      point.mutable_position()->set_z(0.1 + 3.0 * (x * x + y * y));
      point.set_pressure((i % 1024) / 1023.0);
      points.push_back(point);
    }
    return points;
  }
  static v1::Operation adding(const std::vector<v1::Point>& points, const std::string& entity = "shape-1") {
    v1::Operation operation;
    operation.mutable_add_points()->set_entity(entity);
    operation.mutable_add_points()->mutable_points()->Assign(points.begin(), points.end());
    return operation;
  }
  void fit(const std::string& entity = "shape-1") {
    v1::Operation operation;
    operation.mutable_fit()->set_entity(entity);
    ASSERT_TRUE(model_.submit(operation).ok());
  }
  void undo() {
    v1::Operation operation;
    operation.mutable_undo();
    ASSERT_TRUE(model_.submit(operation).ok());
  }

  model::Model model_;
  MeshCache meshes_{[](const std::function<void()>& job) { job(); }, [] {}};
  SceneBuilder builder_{7, meshes_};
};

TEST_F(ViewerTest, begins_with_a_snapshot_and_falls_silent) {
  create();
  Viewer viewer;
  const auto first = viewer.next(*scene());
  ASSERT_TRUE(first && first->has_snapshot());
  EXPECT_EQ(first->snapshot().epoch(), 7U);
  EXPECT_EQ(first->snapshot().history().undo_steps(), 1U);
  EXPECT_TRUE(first->snapshot().entities(0).selected());
  EXPECT_FALSE(viewer.next(*scene()));
}

TEST_F(ViewerTest, a_growing_stroke_costs_its_new_points_only) {
  create();
  ASSERT_TRUE(model_.submit(adding(bowl(5000))).ok());
  Viewer viewer;
  Mirror mirror;
  catch_up(viewer, mirror, *scene());
  const auto gesture = model_.begin_provisional(adding(bowl(1, 0.01)));
  ASSERT_TRUE(gesture.ok());
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(model_.append_provisional(*gesture, bowl(1, 0.001 * i)).ok());
    const auto delta = viewer.next(*scene());
    ASSERT_TRUE(delta && delta->has_delta());
    EXPECT_EQ(delta->delta().capture_time_ns(), 42);
    ASSERT_EQ(delta->delta().changed_size(), 1);
    EXPECT_TRUE(delta->delta().changed(0).provisional());
    EXPECT_LT(delta->ByteSizeLong(), 600U);
    mirror.take(*delta);
  }
  EXPECT_EQ(mirror.entities["shape-1"].points.total, 5021U);
}

TEST_F(ViewerTest, a_cancelled_gesture_takes_its_points_back) {
  create();
  ASSERT_TRUE(model_.submit(adding(bowl(10))).ok());
  Viewer viewer;
  Mirror mirror;
  const auto gesture = model_.begin_provisional(adding(bowl(30, 0.01)));
  ASSERT_TRUE(gesture.ok());
  catch_up(viewer, mirror, *scene());
  EXPECT_EQ(mirror.entities["shape-1"].points.total, 40U);
  model_.cancel_provisional(*gesture);
  catch_up(viewer, mirror, *scene());
  EXPECT_EQ(mirror.entities["shape-1"].points.total, 10U);
  EXPECT_FALSE(mirror.entities["shape-1"].state.provisional());
}

TEST_F(ViewerTest, an_undo_and_other_points_in_their_place_are_told_apart) {
  create();
  ASSERT_TRUE(model_.submit(adding(bowl(100))).ok());
  ASSERT_TRUE(model_.submit(adding(bowl(50, 0.01))).ok());
  Viewer viewer;
  Mirror mirror;
  catch_up(viewer, mirror, *scene());
  undo();
  ASSERT_TRUE(model_.submit(adding(bowl(50, 0.02))).ok());  // as many points, so counting would not notice
  catch_up(viewer, mirror, *scene());
  Viewer late;
  Mirror fresh;
  catch_up(late, fresh, *scene());
  expect_same(mirror, fresh);
}

TEST_F(ViewerTest, A23_a_fit_brings_its_mesh_once) {
  create();
  ASSERT_TRUE(model_.submit(adding(bowl(200))).ok());
  Viewer viewer;
  Mirror mirror;
  catch_up(viewer, mirror, *scene());
  fit();
  const auto delta = viewer.next(*scene());
  ASSERT_TRUE(delta);
  ASSERT_TRUE(delta->delta().changed(0).has_surface());
  EXPECT_FALSE(delta->delta().changed(0).has_points());
  const auto mesh = codec::decode_mesh(delta->delta().changed(0).surface());
  ASSERT_TRUE(mesh.ok());
  EXPECT_GT(mesh->indices.size(), 100U);
  EXPECT_FALSE(viewer.next(*scene()));
  undo();
  const auto gone = viewer.next(*scene());
  ASSERT_TRUE(gone);
  EXPECT_FALSE(gone->delta().changed(0).surface_shown());
}

TEST_F(ViewerTest, a_slow_viewer_gets_the_newest_state_in_one_message) {
  create();
  Viewer viewer;
  Mirror mirror;
  catch_up(viewer, mirror, *scene());
  for (int i = 0; i < 50; ++i) {
    ASSERT_TRUE(model_.submit(adding(bowl(20, 0.0001 * i))).ok());
    static_cast<void>(scene());
  }
  mirror.messages = 0;
  catch_up(viewer, mirror, *scene());
  EXPECT_EQ(mirror.messages, 1U);
  EXPECT_EQ(mirror.entities["shape-1"].points.total, 1000U);
}

TEST_F(ViewerTest, large_scenes_come_in_pieces_within_the_limit) {
  create();
  ASSERT_TRUE(model_.submit(adding(bowl(5000))).ok());
  create();
  ASSERT_TRUE(model_.submit(adding(bowl(3000), "shape-2")).ok());
  Viewer viewer(ViewerLimits{.max_message_bytes = 20'000, .max_points_per_message = 1000});
  Mirror mirror;
  const ScenePtr all = scene();
  while (const auto envelope = viewer.next(*all)) {
    EXPECT_LT(envelope->ByteSizeLong(), 200'000U);
    mirror.take(*envelope);
  }
  EXPECT_GT(mirror.messages, 4U);
  Viewer whole;
  Mirror other;
  catch_up(whole, other, *all);
  expect_same(mirror, other);
}

TEST_F(ViewerTest, C1_a_late_joiner_sees_what_a_viewer_of_all_along_sees) {
  std::mt19937 random(20261122);
  const auto pick = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  create();
  Viewer viewer;
  Mirror mirror;
  model::ProvisionalId gesture = 0;  // 0: none
  for (int step = 0; step < 300; ++step) {
    v1::Operation operation;
    switch (pick(7)) {
      case 0:
        operation.mutable_create_dual_shape();
        static_cast<void>(model_.submit(operation));
        break;
      case 1:
        static_cast<void>(model_.submit(adding(bowl(1 + pick(40), 0.001 * pick(9)), "shape-1")));
        break;
      case 2:
        operation.mutable_fit()->set_entity("shape-1");
        static_cast<void>(model_.submit(operation));
        break;
      case 3:
        operation.mutable_undo();
        static_cast<void>(model_.submit(operation));
        break;
      case 4:
        operation.mutable_redo();
        static_cast<void>(model_.submit(operation));
        break;
      case 5:
        operation.mutable_rename()->set_entity("shape-1");
        operation.mutable_rename()->set_name("Top " + std::to_string(step));
        static_cast<void>(model_.submit(operation));
        break;
      default:
        if (gesture == 0) {
          const auto begun = model_.begin_provisional(adding(bowl(3, 0.002)));
          if (begun) gesture = *begun;
        } else if (pick(2) == 0) {
          static_cast<void>(model_.append_provisional(gesture, bowl(2, 0.003)));
        } else {
          if (pick(2) == 0) {
            model_.cancel_provisional(gesture);
          } else {
            static_cast<void>(model_.commit_provisional(gesture));
          }
          gesture = 0;
        }
    }
    const ScenePtr now = scene();
    if (pick(3) == 0) {
      if (const auto one = viewer.next(*now)) mirror.take(*one);  // reads now and then
    }
  }
  const ScenePtr last = scene();
  catch_up(viewer, mirror, *last);
  Viewer late;
  Mirror fresh;
  catch_up(late, fresh, *last);
  expect_same(mirror, fresh);
}

TEST_F(ViewerTest, A2_A3_styles_are_the_shells_of_the_pressure) {
  create();
  std::vector<v1::Point> points = bowl(2);
  points[0].set_pressure(1.0);
  points[1].set_pressure(818.0 / 1023.0);
  ASSERT_TRUE(model_.submit(adding(points)).ok());
  const auto packed = pack_points(model_.document().find_dual("shape-1")->points, 0, 2);
  ASSERT_TRUE(packed.ok());
  ASSERT_EQ(packed->palette_size(), 2);
  EXPECT_NEAR(packed->palette(0).radius_m(), 0.02 * 0.0127, 1e-9) << "A2: rho = 1 is R_min, not nothing";
  EXPECT_NEAR(packed->palette(1).shell_alpha(0), 0.0800, 2e-4);  // A3's table for rho = 0.8
  EXPECT_NEAR(packed->palette(1).shell_alpha(4), 0.3636, 5e-4);
}

TEST(MeshCacheTest, makes_each_mesh_once_and_drops_superseded_jobs) {
  std::vector<std::function<void()>> jobs;
  int ready = 0;
  MeshCache cache([&](std::function<void()> job) { jobs.push_back(std::move(job)); }, [&] { ++ready; });
  model::Model model;
  v1::Operation operation;
  operation.mutable_create_dual_shape();
  ASSERT_TRUE(model.submit(operation).ok());
  const auto fit_with = [&](double bend) {
    v1::Operation add;
    add.mutable_add_points()->set_entity("shape-1");
    for (int i = 0; i < 60; ++i) {
      v1::Point& point = *add.mutable_add_points()->add_points();
      const double x = 0.01 * (i % 8);
      const double y = 0.01 * (i / 8);
      point.mutable_position()->set_x(x);
      point.mutable_position()->set_y(y);
      point.mutable_position()->set_z(bend * x * x);
      point.set_pressure(1.0);
    }
    ASSERT_TRUE(model.submit(add).ok());
    v1::Operation fit;
    fit.mutable_fit()->set_entity("shape-1");
    ASSERT_TRUE(model.submit(fit).ok());
  };
  const auto round = [&] {
    cache.begin_round();
    auto mesh = cache.find(*model.document().find_dual("shape-1"));
    cache.end_round();
    return mesh;
  };
  fit_with(1.0);
  EXPECT_EQ(round(), nullptr);
  EXPECT_EQ(round(), nullptr);
  ASSERT_EQ(jobs.size(), 1U) << "one fit, one job";
  fit_with(2.0);
  EXPECT_EQ(round(), nullptr);
  ASSERT_EQ(jobs.size(), 2U);
  jobs[0]();
  EXPECT_EQ(cache.statistics().made, 0U) << "nobody wants the first fit any more";
  jobs[1]();
  EXPECT_EQ(cache.statistics().made, 1U);
  EXPECT_EQ(ready, 1);
  EXPECT_NE(round(), nullptr);
  EXPECT_EQ(cache.statistics().pending, 0U);
}

}  // namespace
}  // namespace handloft::stream
