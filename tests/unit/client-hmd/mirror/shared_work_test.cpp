// What people share through the server, as the mirror reads it (U1, U5, U6; F1): saved state, comments,
// versions, people, leases; and that what is wrong is refused whole.

#include "client-hmd/mirror/read_shared_work.h"

#include <gtest/gtest.h>

#include <limits>

#include "client-hmd/mirror/scene_mirror.h"

namespace handloft::client {
namespace {

v1::SceneSnapshot snapshot() {
  v1::SceneSnapshot snapshot;
  snapshot.set_epoch(7);
  snapshot.set_sequence(10);
  return snapshot;
}

TEST(SharedWork, IsSavedOnlyWhenItIsOnTheDisk_U5) {
  SceneMirror mirror;
  ASSERT_TRUE(mirror.apply(snapshot()).ok());
  const auto state = [&mirror] { return saved_state(mirror.scene()->storage, mirror.scene()->sequence); };
  EXPECT_EQ(state(), SavedState::unknown) << "an older server says nothing";
  v1::SceneSnapshot kept = snapshot();
  kept.mutable_storage()->set_kept(true);
  kept.mutable_storage()->set_durable_sequence(9);
  ASSERT_TRUE(mirror.apply(kept).ok());
  EXPECT_EQ(state(), SavedState::saving) << "operation 10 is not on the disk";
  v1::SceneDelta delta;
  delta.set_epoch(7);
  delta.set_sequence(10);
  delta.mutable_storage()->set_kept(true);
  delta.mutable_storage()->set_durable_sequence(10);
  ASSERT_TRUE(mirror.apply(delta).ok());
  EXPECT_EQ(state(), SavedState::saved);
  delta.set_sequence(11);
  delta.clear_storage();
  ASSERT_TRUE(mirror.apply(delta).ok());
  EXPECT_EQ(state(), SavedState::saving) << "something came since";
  delta.mutable_storage()->set_kept(false);
  ASSERT_TRUE(mirror.apply(delta).ok());
  EXPECT_EQ(state(), SavedState::not_kept);
  delta.mutable_storage()->set_kept(true);
  delta.mutable_storage()->set_durable_sequence(11);
  delta.mutable_storage()->set_problem("the disk is full");
  ASSERT_TRUE(mirror.apply(delta).ok());
  EXPECT_EQ(state(), SavedState::failing);
}

v1::Comment& add(v1::SceneSnapshot& to, const std::string& id, const std::string& text) {
  v1::Comment& comment = *to.mutable_comments()->add_comments();
  comment.set_id(id);
  comment.set_text(text);
  return comment;
}

TEST(SharedWork, HasCommentsAndVersionsUntilTheyAreToldAnew_U6) {
  SceneMirror mirror;
  v1::SceneSnapshot first = snapshot();
  add(first, "comment-1", "too flat").mutable_place()->set_z(0.05);
  add(first, "comment-2", "yes").set_reply_to("comment-1");
  add(first, "comment-3", "done").set_resolved(true);
  v1::Version& version = *first.mutable_versions()->add_versions();
  version.set_name("for the client");
  version.set_author("Ann");
  ASSERT_TRUE(mirror.apply(first).ok());
  ASSERT_NE(mirror.scene()->comments, nullptr);
  ASSERT_EQ(mirror.scene()->comments->size(), 3U);
  EXPECT_TRUE(mirror.scene()->comments->front().placed);
  EXPECT_FLOAT_EQ(mirror.scene()->comments->front().z, 0.05F);
  const auto open = open_threads(*mirror.scene()->comments);
  ASSERT_EQ(open.size(), 1U) << "neither replies nor resolved ones have pins";
  EXPECT_EQ(open[0]->text, "too flat");
  EXPECT_EQ(mirror.scene()->versions->front().author, "Ann");

  v1::SceneDelta delta;
  delta.set_epoch(7);
  delta.set_sequence(11);
  ASSERT_TRUE(mirror.apply(delta).ok());
  EXPECT_EQ(mirror.scene()->comments->size(), 3U) << "absent: unchanged";
  delta.mutable_comments();
  delta.mutable_versions();
  ASSERT_TRUE(mirror.apply(delta).ok());
  EXPECT_TRUE(mirror.scene()->comments->empty());
  EXPECT_TRUE(mirror.scene()->versions->empty());
}

TEST(SharedWork, RefusesWhatIsWrongWhole_F1) {
  const auto refused = [](const v1::SceneSnapshot& bad) {
    SceneMirror mirror;
    EXPECT_TRUE(mirror.apply(snapshot()).ok());
    const auto before = mirror.scene();
    const Status status = mirror.apply(bad);
    EXPECT_EQ(mirror.scene(), before);
    return status.ok() ? std::string() : status.error().field;
  };
  v1::SceneSnapshot bad = snapshot();
  add(bad, "a", "x").mutable_place()->set_x(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(refused(bad), "comments[0].place");
  bad = snapshot();
  add(bad, "a", "x").mutable_place()->set_y(1e30);
  EXPECT_EQ(refused(bad), "comments[0].place");
  bad = snapshot();
  add(bad, "a", "x");
  add(bad, "a", "y");
  EXPECT_EQ(refused(bad), "comments[1].id") << "twice the same";
  bad = snapshot();
  add(bad, "a", std::string(5000, 'x'));
  EXPECT_EQ(refused(bad), "comments[0].text");
  bad = snapshot();
  for (int i = 0; i < 5000; ++i) add(bad, std::to_string(i), "x");
  EXPECT_EQ(refused(bad), "comments");
  bad = snapshot();
  for (int i = 0; i < 1100; ++i) add(bad, std::to_string(i), std::string(4000, 'x'));
  EXPECT_EQ(refused(bad), "comments") << "4 MiB of words";
  bad = snapshot();
  bad.mutable_versions()->add_versions();
  EXPECT_EQ(refused(bad), "versions[0].name");
  bad = snapshot();
  for (int i = 0; i < 2000; ++i) bad.mutable_versions()->add_versions()->set_name(std::to_string(i));
  EXPECT_EQ(refused(bad), "versions");
  bad = snapshot();
  bad.mutable_storage()->set_problem(std::string(5000, 'x'));
  EXPECT_EQ(refused(bad), "storage.problem");
  bad = snapshot();
  bad.mutable_history()->set_undo_refused(std::string(5000, 'x'));
  EXPECT_EQ(refused(bad), "history");
  bad = snapshot();
  v1::EntityState& leased = *bad.add_entities();
  leased.set_id("top");
  leased.set_leased_by_name(std::string(500, 'x'));
  EXPECT_EQ(refused(bad), "entities[0].leased_by_name");
}

TEST(SharedWork, KnowsWhoIsHereAsWhat_U1_U2) {
  v1::People people;
  for (int i = 0; i < 1000; ++i) {
    v1::Person& one = *people.add_people();
    one.set_client_id(static_cast<std::uint64_t>(i));
    one.set_name(std::string(1000, 'n'));
    one.set_role("editor");
  }
  const auto here = read_people(people, MirrorLimits());
  EXPECT_EQ(here->size(), MirrorLimits().max_people);
  EXPECT_EQ(here->front().role, "editor");
  EXPECT_EQ(here->front().name.size(), MirrorLimits().max_text_bytes);
}

TEST(SharedWork, NamesWhoShapesAnEntity_U1) {
  SceneMirror mirror;
  v1::SceneSnapshot first = snapshot();
  v1::EntityState& top = *first.add_entities();
  top.set_id("top");
  top.set_revision(1);
  top.set_leased_by(42);
  top.set_leased_by_name("Mira");
  ASSERT_TRUE(mirror.apply(first).ok());
  EXPECT_EQ(mirror.scene()->entities.at("top")->leased_by_name, "Mira");
  v1::SceneDelta delta;
  delta.set_epoch(7);
  delta.set_sequence(11);
  v1::EntityState& free = *delta.add_changed();
  free.set_id("top");
  free.set_revision(2);
  ASSERT_TRUE(mirror.apply(delta).ok());
  EXPECT_EQ(mirror.scene()->entities.at("top")->leased_by, 0U);
}

}  // namespace
}  // namespace handloft::client
