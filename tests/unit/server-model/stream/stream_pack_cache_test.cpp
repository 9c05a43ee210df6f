// What viewers share of what they are sent (C3): the same bytes as if each had packed them, once; bounded,
// and of nothing that is gone.

#include <gmock/gmock.h>

#include <cmath>
#include <cstddef>
#include <memory>
#include <new>
#include <string>
#include <thread>
#include <vector>

#include "server-model/model/model.h"
#include "server-model/stream/pack_cache.h"
#include "server-model/stream/scene_builder.h"
#include "server-model/stream/viewer.h"

namespace handloft::stream {
namespace {

model::PointCloud cloud(int count, double height_m = 0.1) {
  std::vector<model::DualPoint> points(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    model::DualPoint& point = points[static_cast<std::size_t>(i)];
    point.x = 0.1 * std::sin(0.7 * i);
    point.y = 0.1 * std::cos(1.1 * i);
    point.z = height_m;
    point.pressure = (i % 1024) / 1023.0;
  }
  model::PointCloud result;
  result.append(points);
  return result;
}

model::DualPtr shape(int count, double height_m = 0.1) {
  auto made = std::make_shared<model::DualShape>();
  made->points = cloud(count, height_m);
  return made;
}

std::string bytes_of(const Result<PackCache::Points>& packed) {
  return packed ? (*packed)->SerializeAsString() : packed.error().describe();
}

std::string anew(const model::DualPtr& shape, std::size_t first, std::size_t end) {
  return pack_points(shape->points, first, end)->SerializeAsString();
}

constexpr int large = 5000;

class PackCacheTest : public ::testing::Test {
 protected:
  ManualClock clock_{from_ns(1'000'000'000'000)};
};

TEST_F(PackCacheTest, packs_once_what_many_ask_for) {
  PackCache cache(clock_);
  const model::DualPtr one = shape(large), other = shape(large, 0.2);
  ASSERT_NE(anew(one, 0, large), anew(other, 0, large)) << "else sharing the wrong one would not show";
  const auto first = cache.points(one, 0, large);
  EXPECT_EQ(bytes_of(first), anew(one, 0, large));
  for (int i = 0; i < 3; ++i) EXPECT_EQ(*cache.points(one, 0, large), *first) << "the same message";
  EXPECT_EQ(cache.statistics().packed, 1U);
  EXPECT_EQ(cache.statistics().shared, 3U);
  EXPECT_EQ(bytes_of(cache.points(other, 0, large)), anew(other, 0, large));
  EXPECT_EQ(bytes_of(cache.points(one, 1000, large)), anew(one, 1000, large));
  EXPECT_EQ(bytes_of(cache.points(one, 0, large - 1)), anew(one, 0, large - 1));
  EXPECT_EQ(cache.statistics().packed, 4U);
  EXPECT_EQ(cache.statistics().entries, 4U);
  EXPECT_GT(cache.statistics().bytes, (*first)->ByteSizeLong());
}

TEST_F(PackCacheTest, keeps_no_steps_of_strokes) {
  PackCache cache(clock_);
  const model::DualPtr stroke = shape(large);
  for (int i = 0; i < 2; ++i)
    EXPECT_EQ(bytes_of(cache.points(stroke, large - 3, large)), anew(stroke, large - 3, large));
  EXPECT_EQ(cache.statistics().packed, 2U);
  EXPECT_EQ(cache.statistics().bytes, 0U);
}

TEST_F(PackCacheTest, lets_go_of_what_is_gone_or_unused) {
  PackCache cache(clock_, {.keep_for = std::chrono::seconds(10)});
  const model::DualPtr stays = shape(large), unused = shape(large);
  model::DualPtr goes = shape(large);
  const std::weak_ptr<const model::DualShape> gone = goes;
  for (const auto& each : {stays, unused, goes}) ASSERT_TRUE(cache.points(each, 0, large).ok());
  clock_.advance(std::chrono::seconds(9));
  ASSERT_TRUE(cache.points(stays, 0, large).ok());
  cache.sweep();
  EXPECT_EQ(cache.statistics().entries, 3U) << "all are alive and were used";
  goes.reset();
  EXPECT_TRUE(gone.expired()) << "a cache keeps no geometry alive";
  cache.sweep();
  EXPECT_EQ(cache.statistics().entries, 2U);
  clock_.advance(std::chrono::seconds(1));
  cache.sweep();
  EXPECT_EQ(cache.statistics().entries, 1U) << "nobody has asked for the other in ten seconds";
  clock_.advance(std::chrono::seconds(10));
  cache.sweep();
  EXPECT_EQ(cache.statistics().entries, 0U);
  EXPECT_EQ(cache.statistics().bytes, 0U);
}

// Two shapes at one address, one after the other: who looks only at the address sends the dead one's points.
TEST_F(PackCacheTest, never_takes_a_shape_for_the_one_that_was_there_before) {
  PackCache cache(clock_);
  alignas(model::DualShape) std::byte place[sizeof(model::DualShape)];
  const auto make = [&](double height_m) {
    auto* made = new (&place) model::DualShape();
    made->points = cloud(large, height_m);
    return model::DualPtr(made, [](const model::DualShape* dead) { dead->~DualShape(); });
  };
  model::DualPtr first = make(0.1);
  const std::string before = bytes_of(cache.points(first, 0, large));
  first.reset();
  const model::DualPtr second = make(0.2);
  const std::string after = bytes_of(cache.points(second, 0, large));
  EXPECT_NE(after, before);
  EXPECT_EQ(after, anew(second, 0, large));
  EXPECT_EQ(bytes_of(cache.points(second, 0, large)), after);
  EXPECT_EQ(cache.statistics().entries, 1U);
  EXPECT_EQ(cache.statistics().shared, 1U);
}

// Whoever joins reads all, in order. A cache that makes room for the newest has nothing for the next one when
// the scene is larger than it.
TEST_F(PackCacheTest, has_a_bound_and_is_of_use_beyond_it) {
  std::vector<model::DualPtr> scene;
  scene.reserve(8);
  for (int i = 0; i < 8; ++i) scene.push_back(shape(large, 0.01 * i));
  std::size_t of_one = 0;
  {
    PackCache measure(clock_);
    ASSERT_TRUE(measure.points(scene[0], 0, large).ok());
    of_one = measure.statistics().bytes;
  }
  PackCache cache(clock_, {.max_bytes = 4 * of_one + of_one / 2});
  for (int viewer = 0; viewer < 3; ++viewer) {
    for (const auto& each : scene) {
      EXPECT_EQ(bytes_of(cache.points(each, 0, large)), anew(each, 0, large));
      EXPECT_LE(cache.statistics().bytes, 4 * of_one + of_one / 2);
    }
  }
  EXPECT_EQ(cache.statistics().entries, 4U);
  EXPECT_EQ(cache.statistics().shared, 2U * 4U) << "the second and the third viewer's";
  // What is gone makes room.
  scene[0].reset();
  ASSERT_TRUE(cache.points(scene[7], 0, large).ok());
  ASSERT_TRUE(cache.points(scene[7], 0, large).ok());
  EXPECT_EQ(cache.statistics().shared, 2U * 4U + 1U);
  PackCache none(clock_, {.max_bytes = 0});
  EXPECT_EQ(bytes_of(none.points(scene[1], 0, large)), anew(scene[1], 0, large));
  EXPECT_EQ(none.statistics().bytes, 0U);
}

TEST_F(PackCacheTest, says_what_cannot_be_packed_and_keeps_nothing_of_it) {
  PackCache cache(clock_);
  auto far = std::make_shared<model::DualShape>();
  std::vector<model::DualPoint> points(large);
  for (auto& point : points) point.x = 1e9;  // The codec's points are within 10 km.
  far->points.append(points);
  EXPECT_FALSE(cache.points(far, 0, large).ok());
  EXPECT_EQ(cache.statistics().entries, 0U);
}

TEST_F(PackCacheTest, may_be_asked_by_many_at_once) {
  std::vector<model::DualPtr> scene;
  std::vector<std::string> expected;
  scene.reserve(4);
  expected.reserve(4);
  for (int i = 0; i < 4; ++i) {
    scene.push_back(shape(2000, 0.01 * i));
    expected.push_back(anew(scene.back(), 0, 2000));
  }
  PackCache cache(clock_, {.max_bytes = 150'000});
  std::vector<std::thread> threads;
  std::vector<int> wrong(4, 0);
  threads.reserve(wrong.size());
  for (std::size_t t = 0; t < wrong.size(); ++t) {
    threads.emplace_back([&, t] {
      for (std::size_t i = 0; i < 40; ++i) {
        const std::size_t which = (i + t) % scene.size();
        if (bytes_of(cache.points(scene[which], 0, 2000)) != expected[which]) ++wrong[t];
        if (i % 8 == 0) cache.sweep();
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_THAT(wrong, ::testing::Each(0));
  EXPECT_EQ(cache.statistics().packed + cache.statistics().shared, 4U * 40U);
  EXPECT_LE(cache.statistics().bytes, 150'000U);
}

// ---- what viewers get

class SharingViewersTest : public PackCacheTest {
 protected:
  void SetUp() override {
    for (int i = 0; i < 3; ++i) {
      v1::Operation create;
      create.mutable_create_dual_shape()->set_id("shape" + std::to_string(i));
      ASSERT_TRUE(model_.submit(create).ok());
      add("shape" + std::to_string(i), 3000, 0.02 * i);
    }
    v1::Operation fit;
    fit.mutable_fit()->set_entity("shape1");
    ASSERT_TRUE(model_.submit(fit).ok());
  }
  void add(const std::string& id, int count, double offset_m) {
    v1::Operation operation;
    operation.mutable_add_points()->set_entity(id);
    for (int i = 0; i < count; ++i) {
      const double x = 0.04 * std::sin(0.7 * i) + offset_m, y = 0.06 * std::cos(1.1 * i);
      v1::Point& point = *operation.mutable_add_points()->add_points();
      point.mutable_position()->set_x(x);
      point.mutable_position()->set_y(y);
      point.mutable_position()->set_z(0.1 + 3.0 * (x * x + y * y));
      point.set_pressure((i % 1024) / 1023.0);
    }
    ASSERT_TRUE(model_.submit(operation).ok());
  }
  ScenePtr scene() { return builder_.build(model_, 42, {}, {}); }
  static std::vector<std::string> messages(Viewer& viewer, const Scene& scene) {
    std::vector<std::string> result;
    while (const auto envelope = viewer.next(scene)) result.push_back(envelope->SerializeAsString());
    return result;
  }

  model::Model model_;
  MeshCache meshes_{[](const std::function<void()>& job) { job(); }, [] {}};
  SceneBuilder builder_{7, meshes_};
};

TEST_F(SharingViewersTest, get_to_the_byte_what_they_would_get_alone) {
  const auto packs = std::make_shared<PackCache>(clock_, PackCacheOptions{.min_mesh_bytes = 1});
  const ViewerLimits small{.max_message_bytes = 30'000, .max_points_per_message = 2000};
  for (const MeshReading reading : {MeshReading::residuals, MeshReading::vertex_streams}) {
    Viewer alone(small, reading), first(small, reading, packs), second(small, reading, packs);
    scene();
    const auto begin = scene();
    const auto expected = messages(alone, *begin);
    EXPECT_GT(expected.size(), 2U);
    EXPECT_EQ(messages(first, *begin), expected);
    const std::uint64_t packed = packs->statistics().packed;
    EXPECT_EQ(messages(second, *begin), expected);
    EXPECT_LE(packs->statistics().packed - packed, 3U) << "the ends of clouds, too short to be kept";
    // It goes on: a cloud grows, another is fitted anew, one is gone.
    add("shape0", 1500, 0.01);
    v1::Operation fit;
    fit.mutable_fit()->set_entity("shape2");
    ASSERT_TRUE(model_.submit(fit).ok());
    scene();
    const auto later = scene();
    const auto changes = messages(alone, *later);
    EXPECT_GT(changes.size(), 0U);
    EXPECT_EQ(messages(first, *later), changes);
    EXPECT_EQ(messages(second, *later), changes);
    EXPECT_NE(changes, expected);
    Viewer late(small, reading, packs), late_alone(small, reading);
    EXPECT_EQ(messages(late, *later), messages(late_alone, *later));
    v1::Operation undo;
    undo.mutable_undo();
    ASSERT_TRUE(model_.submit(undo).ok());
    const auto back = scene();
    EXPECT_EQ(messages(first, *back), messages(alone, *back));
  }
}

TEST_F(SharingViewersTest, of_older_protocols_share_meshes) {
  const auto packs = std::make_shared<PackCache>(clock_, PackCacheOptions{.min_mesh_bytes = 1});
  scene();
  const auto now = scene();
  const auto mesh = now->entities.at("shape1").surface;
  ASSERT_TRUE(mesh);
  const auto first = packs->vertex_streams(mesh), second = packs->vertex_streams(mesh);
  ASSERT_TRUE(first.ok());
  EXPECT_EQ(*first, *second);
  EXPECT_EQ(packs->statistics().packed, 1U);
  EXPECT_EQ(packs->statistics().shared, 1U);
  EXPECT_GT(packs->statistics().bytes, 0U);
}

}  // namespace
}  // namespace handloft::stream
