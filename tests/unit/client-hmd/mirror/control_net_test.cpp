#include <gtest/gtest.h>

#include <bit>
#include <limits>

#include "client-hmd/mirror/control_net_asker.h"

namespace handloft::client {
namespace {

std::string bytes_of(const std::vector<float>& values) {
  std::string bytes;
  for (const float value : values) {
    const auto word = std::bit_cast<std::uint32_t>(value);
    for (unsigned i = 0; i < 4; ++i) bytes.push_back(static_cast<char>(word >> (8 * i) & 0xFFU));
  }
  return bytes;
}

v1::ControlNetResult good_net() {
  v1::ControlNetResult message;
  message.set_entity("top");
  message.set_rows(2);
  message.set_columns(2);
  message.set_points(bytes_of({0, 0, 0, 0, 1, 0, 1, 0, 0, 1, 1, 0.5F}));
  return message;
}

Scene scene_with(std::uint64_t revision, Representation representation = Representation::surface) {
  auto entity = std::make_shared<Entity>();
  entity->id = entity->name = "top";
  entity->revision = revision;
  entity->representation = representation;
  entity->surface = std::make_shared<const SurfaceMesh>();
  Scene scene;
  scene.entities["top"] = entity;
  return scene;
}

v1::Answer answer_to(const v1::Envelope& question) {
  v1::Answer answer;
  answer.set_request(question.ask().request());
  *answer.mutable_result()->mutable_control_net() = good_net();
  return answer;
}

TEST(ControlNet, IsReadRowByRow_V3) {
  const Result<ControlNet> net = read_control_net(good_net());
  ASSERT_TRUE(net.ok()) << net.error().describe();
  EXPECT_EQ(net->rows, 2U);
  EXPECT_EQ(net->points.size(), 4U);
  EXPECT_EQ(net->points[1], (Vec3f{0, 1, 0}));
  EXPECT_EQ(net->points[3], (Vec3f{1, 1, 0.5F}));
}

TEST(ControlNet, RefusesWhatCannotBeOne) {
  const auto refused = [](const auto& spoil) {
    v1::ControlNetResult message = good_net();
    spoil(message);
    return !read_control_net(message).ok();
  };
  EXPECT_TRUE(refused([](auto& m) { m.set_rows(1); }));
  EXPECT_TRUE(refused([](auto& m) { m.set_rows(0); }));
  EXPECT_TRUE(refused([](auto& m) { m.set_columns(3); }));
  EXPECT_TRUE(refused([](auto& m) { m.mutable_points()->pop_back(); }));
  EXPECT_TRUE(refused([](auto& m) {
    m.set_rows(std::numeric_limits<std::uint32_t>::max());
    m.set_columns(std::numeric_limits<std::uint32_t>::max());
  })) << "nothing is allocated for it";
  EXPECT_TRUE(refused([](auto& m) {
    m.set_points(bytes_of({0, 0, 0, 0, 1, 0, 1, 0, 0, 1, 1, std::numeric_limits<float>::quiet_NaN()}));
  }));
  EXPECT_TRUE(refused([](auto& m) { m.set_points(bytes_of({0, 0, 0, 0, 1, 0, 1, 0, 0, 1, 1, 1e6F})); }));
}

TEST(ControlNetAsker, AsksOncePerRevisionAndOneAtATime_V3) {
  ControlNetAsker asker;
  const auto first = asker.questions(scene_with(1));
  ASSERT_EQ(first.size(), 1U);
  EXPECT_EQ(first[0].ask().query().control_net().entity(), "top");
  EXPECT_TRUE(asker.questions(scene_with(1)).empty()) << "under way";
  EXPECT_TRUE(asker.questions(scene_with(2)).empty()) << "dragged meanwhile: still one under way";
  EXPECT_TRUE(asker.take(answer_to(first[0])));
  EXPECT_EQ(asker.nets().count("top"), 1U);
  const auto second = asker.questions(scene_with(2));
  ASSERT_EQ(second.size(), 1U) << "it is another revision now";
  EXPECT_NE(second[0].ask().request(), first[0].ask().request());
  EXPECT_EQ(asker.nets().count("top"), 1U) << "the old net is shown meanwhile";
  EXPECT_TRUE(asker.take(answer_to(second[0])));
  EXPECT_TRUE(asker.questions(scene_with(2)).empty()) << "known";
  EXPECT_FALSE(asker.take(answer_to(first[0]))) << "to no question of ours any more";
}

TEST(ControlNetAsker, ForgetsWhatIsGoneAndWhatWasRefused) {
  ControlNetAsker asker;
  EXPECT_TRUE(asker.questions(scene_with(1, Representation::points)).empty()) << "nothing to lay a net over";
  const auto asked = asker.questions(scene_with(1));
  ASSERT_EQ(asked.size(), 1U);
  v1::Answer refusal;
  refusal.set_request(asked[0].ask().request());
  refusal.mutable_failure()->set_code("resource_exhausted");
  EXPECT_TRUE(asker.take(refusal));
  EXPECT_TRUE(asker.nets().empty());
  EXPECT_TRUE(asker.questions(scene_with(1)).empty()) << "not again before it has changed";
  const auto again = asker.questions(scene_with(2));
  ASSERT_EQ(again.size(), 1U);
  EXPECT_TRUE(asker.take(answer_to(again[0])));
  EXPECT_TRUE(asker.questions(Scene{}).empty());
  EXPECT_TRUE(asker.nets().empty()) << "the entity is gone";

  ASSERT_EQ(asker.questions(scene_with(3)).size(), 1U);
  asker.forget();
  EXPECT_EQ(asker.questions(scene_with(3)).size(), 1U) << "after the connection broke";
  v1::Answer foreign;
  foreign.set_request(7);
  EXPECT_FALSE(asker.take(foreign));
}

}  // namespace
}  // namespace handloft::client
