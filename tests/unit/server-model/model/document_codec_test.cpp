// A model as bytes and back (U3, D7, D8): histories of several users, versions and comments; files of version
// 1; bytes that nobody has written (F1). Random documents:
// tests/property/server-model/model/state_round_trip.h.

#include "server-model/model/document_codec.h"

#include <google/protobuf/stubs/logging.h>

#include <cmath>
#include <random>
#include <string>

#include "proto/storage.pb.h"
#include "tests/unit/server-model/model/model_helpers.h"

namespace handloft::model {
namespace {

using namespace test;

constexpr std::uint64_t ann = 11;
constexpr std::uint64_t bob = 12;

v1::Operation by(std::uint64_t client, v1::Operation operation) {
  operation.set_client_id(client);
  operation.set_author(client == ann ? "Ann" : "Bob");
  operation.set_made_ns(3);
  return operation;
}

/// Small parts lie inside.
std::string encoded(const Model& model, std::size_t max_steps = 1000) {
  EncodeOptions options;
  options.min_shared_bytes = std::size_t{1} << 30U;
  options.max_steps = max_steps;
  const auto bytes = encode_state(
      {model.history(), model.sequence()}, [](std::string_view, std::string_view) { return Status(); },
      options);
  EXPECT_TRUE(bytes.ok());
  return bytes ? *bytes : std::string();
}

Result<StoredState> decoded(const std::string& bytes) {
  return decode_state(bytes, [](std::string_view) -> Result<std::string> {
    return make_error(ErrorCode::not_found, "part");
  });
}

/// Two users; something of each kind is done and something taken back.
Model busy_model() {
  Model model;
  v1::Operation version, comment, answer, alternative, restore;
  version.mutable_name_version()->set_name("draft");
  version.mutable_name_version()->set_note("why");
  comment.mutable_add_comment()->set_text("here");
  comment.mutable_add_comment()->set_entity("seat");
  answer.mutable_add_comment()->set_text("yes");
  answer.mutable_add_comment()->set_reply_to("comment-1");
  alternative.mutable_new_alternative()->set_name("wide");
  restore.mutable_restore_version()->set_name("draft");
  v1::Operation move;
  move.mutable_transform()->add_entities("seat");
  move.mutable_transform()->mutable_rotation()->set_w(2);
  move.mutable_transform()->mutable_rotation()->set_x(1);
  for (const v1::Operation& operation :
       {by(ann, create("seat")), by(ann, add("seat", saddle_points())), by(ann, version), by(ann, move),
        by(bob, comment), by(ann, fit("seat")), by(bob, answer), by(bob, create("back")), by(ann, undo()),
        by(bob, alternative), by(bob, rename("seat", "Seat")), by(bob, restore), by(bob, undo())}) {
    const auto submitted = model.submit(operation);
    EXPECT_TRUE(submitted.ok()) << operation.ShortDebugString() << submitted.error().describe();
  }
  return model;
}

TEST(DocumentCodec, U1U3U6_AModelOfSeveralUsersComesBack) {
  const Model model = busy_model();
  const std::string bytes = encoded(model);
  const auto state = decoded(bytes);
  ASSERT_TRUE(state.ok()) << state.error().describe();
  EXPECT_EQ(document_hash(state->history.current()), document_hash(model.document()));
  EXPECT_EQ(state->sequence, model.sequence());
  EXPECT_EQ(encoded(Model::restored({state->history, state->sequence, {}})), bytes) << "shared as before";
  for (const std::uint64_t client : {ann, bob}) {
    EXPECT_EQ(state->history.undo_steps(client), model.history().undo_steps(client));
    EXPECT_EQ(state->history.redo_steps(client), model.history().redo_steps(client));
    EXPECT_EQ(state->history.undo_refused(client), model.history().undo_refused(client));
    EXPECT_EQ(state->history.redo_refused(client), model.history().redo_refused(client));
  }
  EXPECT_NE(model.history().undo_refused(ann) + model.history().redo_refused(ann), "")
      << "or this shows little";
  const StepInfo& last = state->history.entries().back().step->info;
  EXPECT_EQ(last.author, "Bob");
  EXPECT_EQ(last.made_ns, 3);
  EXPECT_EQ(last.sequence, 12U);
  // What goes on after it is the same, too (D6).
  Model restored = Model::restored({state->history, state->sequence, {}});
  Model original = busy_model();
  for (const v1::Operation& operation : {by(bob, undo()), by(bob, undo()), by(ann, undo()), by(ann, redo()),
                                         by(bob, redo()), by(ann, create("arm"))}) {
    const auto a = original.submit(operation), b = restored.submit(operation);
    ASSERT_EQ(a.ok(), b.ok());
    if (!a) {
      EXPECT_EQ(a.error().message, b.error().message);
    }
    EXPECT_EQ(document_hash(original.document()), document_hash(restored.document()));
  }
}

TEST(DocumentCodec, U3_OnlySoManyStepsAreKept) {
  const Model model = busy_model();
  const auto state = decoded(encoded(model, 2));
  ASSERT_TRUE(state.ok());
  EXPECT_EQ(state->history.undo_steps(), 2U);
  EXPECT_EQ(document_hash(state->history.current()), document_hash(model.document()));
}

// D8. Version 1 had one line of steps, as documents one after the other.
TEST(DocumentCodec, D8_AFileOfVersion1IsRead) {
  v1::StoredModel message;
  message.set_version(1);
  message.set_sequence(9);
  for (const char* const name : {"seat", "Seat", "Bench"}) {
    v1::StoredEntity& entity = *message.add_entities();
    entity.set_id("seat");
    entity.set_name(name);
    entity.mutable_dual_shape()->set_requested_degree(2);
    entity.mutable_dual_shape()->set_superellipse_exponent(2);
  }
  v1::StoredEntitySet& set = *message.add_sets();
  set.add_entities(0);
  message.mutable_base()->set_next_shape(1);
  message.mutable_base()->set_has_alternatives(true);
  message.mutable_base()->add_alternatives()->set_name("main");
  v1::StoredStep& made = *message.add_steps();
  made.mutable_after()->add_entities(0);
  made.mutable_after()->add_used_ids("seat");
  made.mutable_after()->set_next_shape(1);
  made.set_words("Create \"seat\"");
  v1::StoredStep& branched = *message.add_steps();
  branched.mutable_after()->set_next_shape(1);
  branched.mutable_after()->set_present(1);
  branched.mutable_after()->set_has_alternatives(true);
  branched.mutable_after()->add_alternatives()->set_name("main");
  branched.mutable_after()->mutable_alternatives(0)->set_set(0);
  branched.mutable_after()->add_alternatives()->set_name("wide");
  branched.set_words("New alternative");
  for (const std::uint32_t place : {1U, 2U}) {
    v1::StoredStep& renamed = *message.add_steps();
    renamed.mutable_after()->add_entities(place);
    renamed.mutable_after()->set_next_shape(1);
    renamed.mutable_after()->set_present(1);
    renamed.set_words("Rename");
  }
  message.set_position(3);
  auto state = decoded(message.SerializeAsString());
  ASSERT_TRUE(state.ok()) << state.error().describe();
  History& history = state->history;
  EXPECT_EQ(state->sequence, 9U);
  EXPECT_EQ(history.current().find("seat")->name, "Seat");
  EXPECT_EQ(history.undo_steps(), 3U);
  ASSERT_TRUE(history.redo().ok());
  EXPECT_EQ(history.current().find("seat")->name, "Bench");
  ASSERT_TRUE(history.undo().ok());
  ASSERT_TRUE(history.undo().ok());
  EXPECT_EQ(history.current().find("seat")->name, "seat");
  EXPECT_EQ(*history.undo(), "New alternative");
  EXPECT_EQ(history.current().present_alternative(), "main");
  EXPECT_EQ(*history.undo(), "Create \"seat\"");
  EXPECT_EQ(document_hash(history.current()), document_hash(Document()));
  EXPECT_FALSE(history.undo().ok());
}

TEST(DocumentCodec, D8_ANewerVersionIsNotGuessedAt) {
  v1::StoredModel message;
  message.set_version(4);
  EXPECT_EQ(decoded(message.SerializeAsString()).error().code, ErrorCode::unsupported);
}

/// What is changed in a good file, and must be said to be damaged.
void expect_damaged(const char* what, void (*damage)(v1::StoredModel&)) {
  v1::StoredModel message;
  ASSERT_TRUE(message.ParseFromString(encoded(busy_model())));
  damage(message);
  const auto state = decoded(message.SerializeAsString());
  ASSERT_FALSE(state.ok()) << what;
  EXPECT_EQ(state.error().code, ErrorCode::data_corrupt) << what;
  EXPECT_FALSE(state.error().field.empty()) << what;
}

v1::StoredDelta& first_change(v1::StoredModel& message) {
  for (v1::StoredStep& step : *message.mutable_steps()) {
    if (step.delta().entities_size() > 0) return *step.mutable_delta();
  }
  return *message.mutable_steps(0)->mutable_delta();
}

TEST(DocumentCodec, F1_WhatDoesNotFitIsNamed) {
  expect_damaged("place of an entity",
                 [](v1::StoredModel& m) { first_change(m).mutable_entities(0)->set_after(999); });
  expect_damaged("a change of nothing", [](v1::StoredModel& m) {
    first_change(m).mutable_entities(0)->clear_before();
    first_change(m).mutable_entities(0)->clear_after();
  });
  expect_damaged("a change under another id",
                 [](v1::StoredModel& m) { first_change(m).mutable_entities(0)->set_id("x"); });
  expect_damaged("ids twice",
                 [](v1::StoredModel& m) { *first_change(m).add_entities() = first_change(m).entities(0); });
  expect_damaged("a version's set", [](v1::StoredModel& m) { m.mutable_versions(0)->set_set(999); });
  expect_damaged("place of a version", [](v1::StoredModel& m) { m.mutable_current()->add_versions(99); });
  expect_damaged("place of a comment", [](v1::StoredModel& m) { m.mutable_current()->add_comments(99); });
  expect_damaged("a comment nowhere",
                 [](v1::StoredModel& m) { m.mutable_comments(0)->mutable_place()->set_x(std::nan("")); });
  expect_damaged("a motion to nowhere", [](v1::StoredModel& m) {
    for (v1::StoredEntity& entity : *m.mutable_entities()) {
      if (entity.has_motion()) entity.mutable_motion()->set_scale(0);
    }
  });
  expect_damaged("an alternative without content",
                 [](v1::StoredModel& m) { m.mutable_current()->mutable_alternatives(0)->clear_set(); });
  expect_damaged("two of one name",
                 [](v1::StoredModel& m) { m.mutable_current()->mutable_alternatives(0)->set_name("wide"); });
  expect_damaged("none present", [](v1::StoredModel& m) { m.mutable_current()->set_present(7); });
  expect_damaged("steps without order", [](v1::StoredModel& m) { m.mutable_steps(1)->set_number(1); });
  expect_damaged("a step without a number", [](v1::StoredModel& m) { m.mutable_steps(0)->clear_number(); });
  expect_damaged("a step that was never made",
                 [](v1::StoredModel& m) { m.mutable_gone()->set_last_step(1); });
  expect_damaged("early steps that are not there",
                 [](v1::StoredModel& m) { m.mutable_gone()->set_early_steps(999); });
  expect_damaged("more gone than can be", [](v1::StoredModel& m) {
    v1::StoredGoneOf& of = *m.mutable_gone()->add_clients();
    of.set_client_id(999);
    of.set_older(~std::uint64_t{0});
    of.set_newer(2);
  });
  expect_damaged("a client twice", [](v1::StoredModel& m) {
    for (int i = 0; i < 2; ++i) m.mutable_gone()->add_clients()->set_client_id(999);
  });
  expect_damaged("the newest of nobody else", [](v1::StoredModel& m) {
    m.mutable_gone()->mutable_before()->set_client_id(m.mutable_gone()->newest().client_id());
    m.mutable_gone()->mutable_before()->set_step(1);
  });
  expect_damaged("a step stands behind one that is taken back", [](v1::StoredModel& m) {
    for (v1::StoredStep& step : *m.mutable_steps()) {
      if (step.client_id() == bob) {
        step.set_undone(true);
        return;
      }
    }
  });
}

// Whatever is read can be worked with: undo and redo of everybody, queries, new steps; nothing crashes.
TEST(DocumentCodec, F1_BytesThatNobodyHasWritten) {
  const google::protobuf::LogSilencer quiet;  // About names that are no text.
  const std::string good = encoded(busy_model());
  std::mt19937 random(20);
  int read = 0;
  for (int round = 0; round < 3000; ++round) {
    std::string bytes = good;
    const int changes = 1 + static_cast<int>(random() % 4);
    for (int i = 0; i < changes; ++i) bytes[random() % bytes.size()] = static_cast<char>(random() % 256);
    if (round % 10 == 0) bytes.resize(random() % bytes.size());
    auto state = decoded(bytes);
    if (!state) continue;
    ++read;
    Model model = Model::restored({state->history, state->sequence, {}});
    for (const std::uint64_t client : {ann, bob}) {
      for (int i = 0; i < 4; ++i) static_cast<void>(model.submit(by(client, undo())));
      for (int i = 0; i < 2; ++i) static_cast<void>(model.submit(by(client, redo())));
    }
    static_cast<void>(model.submit(by(ann, create("new"))));
    v1::Query query;
    query.mutable_comments()->set_resolved(true);
    EXPECT_TRUE(model.query(query).ok());
    query.mutable_difference()->set_from("draft");
    static_cast<void>(model.query(query));
    EXPECT_EQ(document_hash(model.document()).size(), 64U);
  }
  EXPECT_GT(read, 100) << "most of a file is names and numbers";
}

}  // namespace
}  // namespace handloft::model
