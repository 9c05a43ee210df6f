// Several models on one server (U1): each in a file of its own, opened by who joins it and closed when nobody
// is there; what is wrong with one hurts no other.

#include <fstream>

#include "server-model/store/model_store.h"
#include "tests/support/fault_disk.h"
#include "tests/support/stepped_queue.h"
#include "tests/unit/server-model/session/peers_fixture.h"

namespace handloft::session {
namespace {

namespace fs = std::filesystem;

struct RoomsTest : PeersTest {
  void SetUp() override { start_folder(); }
  void start_folder(RoomsOptions::Create create = RoomsOptions::Create::owners, std::size_t max_models = 4) {
    peers_.reset();  // Two servers must not have one file.
    queue_ = std::make_shared<test::SteppedQueue>();
    fs::create_directories(models());
    ServerOptions options;
    options.model_name = "first";
    options.rooms.folder = models();
    options.rooms.create = create;
    options.rooms.max_models = max_models;
    options.rooms.max_open = 3;
    options.rooms.close_after = std::chrono::minutes(1);
    options.rooms.queue = queue_;
    options.rooms.open = open;
    auto first = open(models() / "first.handloft");
    ASSERT_TRUE(first.ok()) << first.error().describe();
    options.actor.store = first->store;
    start(std::move(options), std::move(first->model));
  }
  fs::path models() const { return folder_.path() / "models"; }
  static Result<OpenedModel> open(const fs::path& path) {
    auto opened = store::ModelStore::open(path, {}, {});
    if (!opened) return opened.error();
    return OpenedModel{std::move(opened->model), opened->store};
  }
  /// Joins, and does what the opening thread does.
  ConnectionPtr on(const std::string& model, v1::Role role = v1::ROLE_OWNER,
                   const std::string& name = "Ann") {
    auto connection = connect(role, name);
    v1::Envelope envelope;
    envelope.mutable_join()->set_model(model);
    const Status said = say(connection, envelope);
    if (!said) {
      refused_ = said.error();
      return connection;
    }
    queue_->run_all();
    wait();
    return connection;
  }
  void wait() {
    for (const RoomPtr& room : peers_->rooms().open_rooms()) {
      do {
        room->actor->settle();
      } while (!room->actor->idle());
      if (room->store) room->store->flush();
      room->actor->settle();
    }
  }
  static std::string joined_model(const ConnectionPtr& connection) {
    std::string model;
    for (const v1::Envelope& envelope : connection->sent()) {
      if (envelope.has_joined()) model = envelope.joined().model();
    }
    return model;
  }
  void draw(const ConnectionPtr& connection, const std::string& entity) {
    v1::Operation operation;
    operation.mutable_create_dual_shape()->set_id(entity);
    submit(connection, operation);
    wait();
  }
  static bool sees(const ConnectionPtr& connection, const std::string& entity) {
    for (const v1::Envelope& envelope : connection->sent()) {
      for (const auto& state : envelope.snapshot().entities()) {
        if (state.id() == entity) return true;
      }
      for (const auto& state : envelope.delta().changed()) {
        if (state.id() == entity) return true;
      }
    }
    return false;
  }
  std::map<std::string, Rooms::Listed> listed() const {
    std::map<std::string, Rooms::Listed> result;
    for (const Rooms::Listed& each : peers_->rooms().list()) result[each.name] = each;
    return result;
  }

  std::shared_ptr<test::SteppedQueue> queue_;
  Error refused_;
};

TEST(ModelName, is_one_that_no_path_hides_in) {
  for (const char* good : {"seat", "Seat-2", "a", "car.seat_3"})
    EXPECT_TRUE(check_model_name(good).ok()) << good;
  for (const char* bad : {"", ".", "..", ".hidden", "a/b", "../a", "a b", "-a", "\xC3\xA4", "a\n"}) {
    EXPECT_FALSE(check_model_name(bad).ok()) << bad;
  }
  EXPECT_TRUE(check_model_name(std::string(64, 'a')).ok());
  EXPECT_FALSE(check_model_name(std::string(65, 'a')).ok());
  EXPECT_FALSE(check_model_name(std::string_view("a\0b", 3)).ok());
}

TEST_F(RoomsTest, U1_each_model_is_its_own) {
  const auto ann = on("seat");
  const auto bo = on("", v1::ROLE_EDITOR, "Bo");
  EXPECT_EQ(joined_model(ann), "seat");
  EXPECT_EQ(joined_model(bo), "first");
  draw(ann, "cushion");
  draw(bo, "wheel");
  EXPECT_TRUE(sees(ann, "cushion"));
  EXPECT_FALSE(sees(ann, "wheel"));
  EXPECT_TRUE(sees(bo, "wheel"));
  EXPECT_FALSE(sees(bo, "cushion"));
  const auto cy = on("seat", v1::ROLE_VIEWER, "Cy");
  EXPECT_TRUE(sees(cy, "cushion"));
  EXPECT_EQ(listed().at("seat").people, 2U);
  EXPECT_EQ(listed().at("first").people, 1U);
  // Presence stays in the room.
  v1::Envelope waving;
  waving.mutable_presence()->set_tool("waving");
  ASSERT_TRUE(say(cy, waving).ok());
  const auto told = [](const ConnectionPtr& connection) {
    const auto sent = connection->sent();
    return std::any_of(sent.begin(), sent.end(),
                       [](const auto& e) { return e.presence().tool() == "waving"; });
  };
  EXPECT_TRUE(told(ann));
  EXPECT_FALSE(told(bo));
  v1::Query query;
  query.mutable_models();
  const v1::ModelsResult models = ask(ann, query).models();
  ASSERT_EQ(models.models_size(), 2);
  EXPECT_EQ(models.models(0).name(), "first");
  EXPECT_EQ(models.models(1).people(), 2U);
  EXPECT_TRUE(models.models(1).open());
}

TEST_F(RoomsTest, U5_a_model_that_nobody_uses_is_closed_and_comes_back_as_it_was) {
  auto ann = on("seat");
  draw(ann, "cushion");
  leave(ann);
  clock_.advance(std::chrono::seconds(59));
  peers_->tick();
  queue_->run_all();
  EXPECT_TRUE(listed().at("seat").open);
  clock_.advance(std::chrono::seconds(1));
  peers_->tick();
  queue_->run_all();
  EXPECT_FALSE(listed().at("seat").open);
  EXPECT_TRUE(listed().at("first").open) << "the first one stays";
  // Its file is closed: another may have it.
  {
    auto other = open(models() / "seat.handloft");
    ASSERT_TRUE(other.ok()) << other.error().describe();
    EXPECT_NE(other->model.document().find("cushion"), nullptr);
    other->store->stop();
  }
  ann = on("seat");
  EXPECT_TRUE(sees(ann, "cushion"));
}

TEST_F(RoomsTest, U5_who_joins_while_it_is_being_closed_gets_it_opened_again) {
  auto ann = on("seat");
  draw(ann, "cushion");
  leave(ann);
  clock_.advance(std::chrono::minutes(2));
  peers_->tick();  // Orders the closing, which has not been done when Bo comes.
  const auto bo = on("seat", v1::ROLE_EDITOR, "Bo");
  EXPECT_EQ(joined_model(bo), "seat");
  EXPECT_TRUE(sees(bo, "cushion"));
}

TEST_F(RoomsTest, U5_a_damaged_file_is_refused_by_its_name_and_hurts_no_other) {
  std::ofstream(models() / "letter.handloft") << "Dear Sir or Madam, this is no model.";
  const auto ann = on("letter");
  EXPECT_TRUE(ann->closed());
  EXPECT_EQ(joined_model(ann), "");
  EXPECT_THAT(listed().at("letter").problem, HasSubstr("letter"));
  const auto bo = on("seat");
  draw(bo, "cushion");
  EXPECT_TRUE(sees(bo, "cushion"));
  v1::Query query;
  query.mutable_models();
  const v1::QueryResult answer = ask(bo, query);
  EXPECT_EQ(answer.models().models_size(), 3);
  for (const auto& model : answer.models().models()) {
    EXPECT_EQ(model.problem().empty(), model.name() != "letter");
  }
  EXPECT_EQ(fs::file_size(models() / "letter.handloft"), 36U) << "never written over";
}

TEST_F(RoomsTest, U5_who_names_no_model_gets_no_other_for_one_that_is_damaged) {
  ServerOptions options;
  options.model_name = "other";
  options.nameless = make_error(ErrorCode::data_corrupt, "main is damaged", "join.model");
  options.rooms.folder = models();
  options.rooms.queue = queue_;
  options.rooms.open = open;
  start(std::move(options));
  const auto ann = connect(v1::ROLE_OWNER, "Ann");
  v1::Envelope join;
  join.mutable_join();
  const Status nameless = say(ann, join);
  ASSERT_FALSE(nameless.ok());
  EXPECT_EQ(nameless.error().message, "main is damaged");
  // A script that never joins would work on the first model.
  v1::Envelope operation, question;
  operation.mutable_submit()->mutable_operation()->mutable_create_dual_shape()->set_id("seat");
  EXPECT_FALSE(say(ann, operation).ok());
  question.mutable_ask()->mutable_query()->mutable_people();
  EXPECT_FALSE(say(ann, question).ok());
  v1::Query which;
  which.mutable_models();
  EXPECT_GE(ask(ann, which).models().models_size(), 1);
  const auto bo = on("other");
  EXPECT_EQ(joined_model(bo), "other");
  draw(bo, "cushion");
  EXPECT_TRUE(sees(bo, "cushion"));
}

TEST_F(RoomsTest, U5_a_model_that_takes_no_more_is_listed_so) {
  test::FaultDisk disk;
  const auto writer = std::make_shared<test::SteppedQueue>(),
             snapshots = std::make_shared<test::SteppedQueue>();
  store::ModelStoreOptions kept;
  kept.log.vfs = disk.name();
  kept.log.mark = store::LogOptions::Mark::none;
  kept.commit.queue = writer;
  kept.snapshots = snapshots;
  auto opened = store::ModelStore::open("/first.handloft", {}, std::move(kept));
  ASSERT_TRUE(opened.ok()) << opened.error().describe();
  ServerOptions options;
  options.model_name = "first";
  options.rooms.queue = queue_;
  options.actor.store = opened->store;
  start(std::move(options), std::move(opened->model));
  EXPECT_EQ(listed().at("first").problem, "");
  disk.fail_at(0, test::FaultDisk::Failure::full_for_good);
  const auto ann = joined(v1::ROLE_OWNER, "Ann");
  v1::Operation operation;
  operation.mutable_create_dual_shape()->set_id("seat");
  submit(ann, operation);
  (void)settled();
  writer->run_all();
  EXPECT_THAT(listed().at("first").problem, HasSubstr("full"));
  v1::Query query;
  query.mutable_models();
  EXPECT_THAT(ask(ann, query).models().models(0).problem(), HasSubstr("full"));
  peers_->stop();  // While there is a disk.
  start({});
}

TEST_F(RoomsTest, U2_only_owners_make_models_and_not_too_many) {
  EXPECT_TRUE(on("seat")->closed() == false);
  start_folder(RoomsOptions::Create::nobody);
  EXPECT_TRUE(on("back")->closed());
  EXPECT_FALSE(fs::exists(models() / "back.handloft"));
  EXPECT_EQ(joined_model(on("seat")), "seat") << "those that are there may be joined";
  start_folder(RoomsOptions::Create::owners, 3);
  EXPECT_TRUE(on("a viewer's", v1::ROLE_VIEWER)->sent().empty());
  EXPECT_EQ(refused_.field, "join.model");
  EXPECT_TRUE(on("back", v1::ROLE_VIEWER)->closed()) << "a viewer makes none";
  EXPECT_FALSE(on("back")->closed());
  EXPECT_TRUE(on("arm")->closed()) << "three there are";
}

TEST_F(RoomsTest, U1_a_connection_has_one_model) {
  const auto ann = on("seat");
  v1::Envelope envelope;
  envelope.mutable_join()->set_model("first");
  const Status said = say(ann, envelope);
  ASSERT_FALSE(said.ok());
  EXPECT_EQ(said.error().code, ErrorCode::failed_precondition);
}

TEST_F(RoomsTest, U1_nothing_more_is_read_of_who_waits_for_a_model) {
  const auto ann = connect(v1::ROLE_OWNER, "Ann");
  v1::Envelope envelope;
  envelope.mutable_join()->set_model("seat");
  ASSERT_TRUE(say(ann, envelope).ok());
  EXPECT_TRUE(ann->paused());
  // Two ask for one model: it is opened once.
  const auto bo = connect(v1::ROLE_OWNER, "Bo");
  ASSERT_TRUE(say(bo, envelope).ok());
  leave(bo);
  EXPECT_EQ(queue_->waiting(), 1U);
  queue_->run_all();
  wait();
  EXPECT_FALSE(ann->paused());
  EXPECT_EQ(joined_model(ann), "seat");
  EXPECT_EQ(joined_model(bo), "") << "gone meanwhile";
  EXPECT_EQ(listed().at("seat").people, 1U);
}

}  // namespace
}  // namespace handloft::session
