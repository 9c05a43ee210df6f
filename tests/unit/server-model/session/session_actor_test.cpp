// The model's thread and the pool beside it: exports that hands and peers ask for, references that are read
// and measured, none of which a hand waits for (A25, A26, A28).

#include "server-model/session/model_actor.h"

#include <gmock/gmock.h>

#include <fstream>
#include <future>
#include <map>
#include <optional>
#include <string>
#include <thread>

#include "tests/support/hand_script.h"
#include "tests/support/test_data.h"

namespace handloft::session {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

model::Model plate(double height_m) {
  model::Model model;
  v1::Operation operation;
  v1::AddPoints& add = *operation.mutable_add_points();
  add.set_entity("plate");
  add.mutable_create();
  for (int i = -4; i <= 4; ++i) {
    for (int k = -4; k <= 4; ++k) {
      v1::Point& point = *add.add_points();
      point.mutable_position()->set_x(0.01 * i);
      point.mutable_position()->set_y(0.01 * k);
      point.mutable_position()->set_z(height_m);
      point.set_pressure(0.5);
    }
  }
  EXPECT_TRUE(model.submit(operation).ok());
  v1::Operation fit;
  fit.mutable_fit()->set_entity("plate");
  EXPECT_TRUE(model.submit(fit).ok());
  return model;
}

class ActorTest : public ::testing::Test {
 protected:
  void start(model::Model initial) {
    ActorOptions options;
    options.export_folder = folder_.path();
    ActorEvents events;
    // On the model's thread; read after state(), which waits for its turn there.
    events.on_presence = [this](const v1::Presence& presence) { tool_ = presence.tool(); };
    actor_.emplace(std::move(initial), options, events, clock_, Logger("test", LogLevel::off));
  }
  /// What presence tells after one frame of the hand.
  std::string told(const v1::TrackingFrame& frame) {
    actor_->push_frame(frame);
    (void)actor_->state();
    return tool_;
  }
  void touch(PaletteCommand command) {
    const PaletteCell& cell = palette_cell_of(command);
    ASSERT_TRUE(is_on_page(cell, first_palette_page));
    (void)told(script_.touching(cell.centre_x_m, cell.centre_y_m));
  }
  /// The hand rests until the pool is done, and one frame more.
  std::string told_when_idle() {
    while (!actor_->idle()) (void)told(script_.resting({0, 0, 0.5}));
    return told(script_.resting({0, 0, 0.5}));
  }
  Result<ModelActor::Outcome> submit(const v1::Operation& operation) {
    std::promise<Result<ModelActor::Outcome>> promise;
    actor_->submit(operation,
                   {folder_.path(), folder_.path(), model::FileAccess::Scope::within_folders, nullptr, {}},
                   [&](Result<ModelActor::Outcome> outcome) { promise.set_value(std::move(outcome)); });
    return promise.get_future().get();
  }
  struct Answer {
    Result<v1::QueryResult> result;
    std::thread::id thread;  ///< On which it was given.
  };
  Answer ask(const v1::Query& query) {
    std::promise<Answer> promise;
    actor_->ask(query, [&](Result<v1::QueryResult> result) {
      promise.set_value({std::move(result), std::this_thread::get_id()});
    });
    return promise.get_future().get();
  }
  /// A square in the plane z = 0, as a file.
  void write_reference(const std::string& name) {
    std::ofstream(folder_.path() / name) << "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3\nf 1 3 4\n";
  }

  test::TemporaryDirectory folder_;
  ManualClock clock_;
  test::HandScript script_;
  std::string tool_;
  std::optional<ModelActor> actor_;
};

TEST_F(ActorTest, A26_a_hands_export_is_written_beside_the_model_and_told_of_for_a_while) {
  start(plate(0.1));
  const std::string before = actor_->state().hash;
  touch(PaletteCommand::export_file);
  EXPECT_EQ(told_when_idle(), "exported main-1.step");
  EXPECT_GT(std::filesystem::file_size(folder_.path() / "main-1.step"), 1000U);
  EXPECT_EQ(actor_->state().hash, before) << "an export changes no document";
  // What the hand does is told rather, and the notice ends.
  EXPECT_EQ(told(script_.laying({0.3, 0, 0.3})), "laying points");
  (void)told(script_.resting({0, 0, 0.5}));
  EXPECT_EQ(told(script_.resting({0, 0, 0.5})), "exported main-1.step");
  clock_.advance(ActorOptions{}.notice_for + std::chrono::milliseconds(1));
  (void)told(script_.resting({0, 0, 0.5}));
  EXPECT_EQ(told(script_.resting({0, 0, 0.5})), "");
}

TEST_F(ActorTest, A26_a_hands_export_is_the_document_of_its_moment) {
  start(plate(0.1));
  touch(PaletteCommand::export_file);
  (void)told(script_.resting({0, 0, 0.5}));
  touch(PaletteCommand::undo);  // The fit, without which there is nothing to export.
  EXPECT_EQ(told_when_idle(), "exported main-1.step");
  touch(PaletteCommand::export_file);
  EXPECT_THAT(told_when_idle(), StartsWith("export refused: ")) << "negative control";
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "main-2.step"));
}

TEST_F(ActorTest, A26_a_hands_export_says_why_not) {
  start(model::Model());
  touch(PaletteCommand::export_file);
  EXPECT_THAT(told_when_idle(), HasSubstr("nothing to export"));
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

TEST_F(ActorTest, A26_a_peers_export_is_answered_from_the_pool) {
  start(plate(0.1));
  v1::Operation operation;
  operation.mutable_export_()->set_path("plate.step");
  const auto outcome = submit(operation);
  ASSERT_TRUE(outcome.ok()) << outcome.error().describe();
  EXPECT_EQ(outcome->entities, std::vector<std::string>{"plate"});
  EXPECT_TRUE(std::filesystem::exists(folder_.path() / "plate.step"));
  operation.mutable_export_()->set_path("../plate.step");
  const auto outside = submit(operation);
  ASSERT_FALSE(outside.ok());
  EXPECT_EQ(outside.error().code, ErrorCode::permission_denied);
}

TEST_F(ActorTest, A28_a_reference_is_read_and_measured_without_the_models_thread) {
  start(plate(0.1));
  write_reference("square.obj");
  v1::Operation operation;
  operation.mutable_import_reference()->set_id("square");
  operation.mutable_import_reference()->set_path("square.obj");
  const auto imported = submit(operation);
  ASSERT_TRUE(imported.ok()) << imported.error().describe();
  v1::Query history;
  history.mutable_history();
  const Answer steps = ask(history);
  ASSERT_TRUE(steps.result.ok());
  v1::Query query;
  query.mutable_distance()->set_entity("plate");
  const Answer distance = ask(query);
  ASSERT_TRUE(distance.result.ok()) << distance.result.error().describe();
  EXPECT_NEAR(distance.result->distance().points().mean_m(), 0.1, 1e-6);
  EXPECT_NE(distance.thread, steps.thread) << "the model's thread goes on meanwhile";
  query.mutable_distance()->set_entity("nothing");
  EXPECT_EQ(ask(query).result.error().code, ErrorCode::not_found);
}

TEST_F(ActorTest, stopped_while_an_export_is_under_way_it_ends_and_says_what_it_knows) {
  start(plate(0.1));
  touch(PaletteCommand::export_file);
  actor_->stop();
  EXPECT_EQ(actor_->state().tracking.frames, 1U);
  actor_->push_frame(script_.resting());  // Returns at once.
  // Whole or not at all.
  const auto file = folder_.path() / "main-1.step";
  EXPECT_TRUE(!std::filesystem::exists(file) || std::filesystem::file_size(file) > 1000U);
}

}  // namespace
}  // namespace handloft::session
