// `handloft-modeld serve --store` as its users have it: what an editor was told is done is there after a kill
// -9 (U5, D1), and the commands over the file say, check, repair and export what it holds.

#include <fcntl.h>
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/net/endpoint.h"
#include "common/net/message_client.h"
#include "server-model/session/remote_target.h"
#include "tests/support/eventually.h"
#include "tests/support/process.h"

namespace handloft::session {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr auto patience = 20s;

class StoreProcess : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = testing::TempDir() + "handloft-served-XXXXXX";
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    folder = pattern;
    model = (folder / "seat.handloft").string();
  }
  void TearDown() override { fs::remove_all(folder); }

  std::string socket() const { return "unix:" + (folder / "model.sock").string(); }
  std::vector<std::string> serve() const {
    return {HANDLOFT_MODELD, "serve", "--listen", socket(), "--store", model};
  }
  RemoteTarget connect() { return connect(key); }
  RemoteTarget connect(const std::string& client_key) {
    RemoteTargetOptions options;
    options.client_key = client_key;
    auto target = RemoteTarget::connect(net::parse_endpoint(socket()).value(), clock, options);
    EXPECT_TRUE(target.ok()) << (target ? "" : target.error().describe());
    return *std::move(target);
  }
  static v1::Operation stroke(int number) {
    v1::Operation operation;
    operation.set_client_op_id(static_cast<std::uint64_t>(number) + 1);
    auto& request = *operation.mutable_add_points();
    request.set_entity("seat");
    if (number == 0) request.mutable_create()->set_degree(2);
    for (int i = 0; i < 12; ++i) {
      v1::Point& point = *request.add_points();
      point.mutable_position()->set_x(0.01 * i);
      point.mutable_position()->set_y(0.01 * number + 0.003);
      point.mutable_position()->set_z(0.001 * i * i);
      point.set_pressure(0.7);
    }
    return operation;
  }
  static std::string hash_of(RemoteTarget& target) {
    v1::Query query;
    query.mutable_hash();
    const auto answer = target.query(query);
    EXPECT_TRUE(answer.ok());
    return answer ? answer->hash().sha256() : "";
  }
  /// The exit status and what the command says in JSON.
  std::pair<int, Json> command(std::vector<std::string> words) {
    words.insert(words.begin(), HANDLOFT_MODELD);
    words.emplace_back("--json");
    test::Process process(words, folder / "log");
    const std::string text = process.read_all(patience);
    const int status = process.wait(patience).value_or(-1);
    return {status, Json::parse(text, nullptr, false)};
  }

  std::string complaint_of_last() const {
    std::ifstream in(folder / "log");
    return {std::istreambuf_iterator<char>(in), {}};
  }

  const std::string key = net::random_client_key();  ///< The same client every time.
  fs::path folder;
  std::string model;
  SystemClock clock;
};

TEST_F(StoreProcess, D1WhatWasAnsweredIsThereAfterAKillAndCanBeUndone) {
  std::string hash;
  int strokes = 0;
  for (int start = 0; start < 5; ++start) {
    test::Process server(serve(), folder / "log");
    ASSERT_TRUE(server.read_line(patience)) << server.error_output();
    auto editor = connect();
    if (start > 0) {
      EXPECT_EQ(hash_of(editor), hash) << "start " << start;
    }
    for (int i = 0; i < 4; ++i, ++strokes) {
      const auto done = editor.submit(stroke(strokes));
      ASSERT_TRUE(done.ok()) << done.error().describe();
      EXPECT_EQ(done->sequence, static_cast<std::uint64_t>(strokes) + 1);
    }
    hash = hash_of(editor);
    server.signal(SIGKILL);
    server.wait(patience);
  }
  test::Process server(serve(), folder / "log");
  ASSERT_TRUE(server.read_line(patience)) << server.error_output();
  auto editor = connect();
  EXPECT_EQ(hash_of(editor), hash);
  v1::Operation undo;
  undo.mutable_undo();
  for (int i = 0; i < strokes; ++i) EXPECT_TRUE(editor.submit(undo).ok()) << i;
  EXPECT_FALSE(editor.submit(undo).ok());
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(patience), 0) << server.error_output();
}

TEST_F(StoreProcess, TheCommandsSayCheckRepairAndExport) {
  std::string hash;
  {
    test::Process server(serve(), folder / "log");
    ASSERT_TRUE(server.read_line(patience)) << server.error_output();
    auto editor = connect();
    for (int i = 0; i < 6; ++i) ASSERT_TRUE(editor.submit(stroke(i)).ok());
    v1::Operation fit;
    fit.mutable_fit()->set_entity("seat");
    ASSERT_TRUE(editor.submit(fit).ok());
    hash = hash_of(editor);
    // Two servers of one model are refused, readers are not.
    test::Process second({HANDLOFT_MODELD, "serve", "--listen", socket() + "2", "--store", model},
                         folder / "log2");
    EXPECT_EQ(second.wait(patience), 1);
    EXPECT_THAT(second.error_output(), testing::HasSubstr("in use by another handloft-modeld"));
    EXPECT_EQ(command({"verify", model}).first, 0);
    server.signal(SIGTERM);
    EXPECT_EQ(server.wait(patience), 0) << server.error_output();
  }
  const auto [listed, models] = command({"models", folder.string()});
  EXPECT_EQ(listed, 0);
  EXPECT_EQ(models["models"][0]["file"], "seat.handloft");
  EXPECT_EQ(models["models"][0]["operations"], 7);
  EXPECT_EQ(models["models"][0]["alternatives"].size(), 1U);
  EXPECT_EQ(command({"models", folder.string(), "--verify"}).first, 0);
  const auto [told, history] = command({"history", model, "--from", "6"});
  EXPECT_EQ(told, 0);
  ASSERT_EQ(history["operations"].size(), 2U);
  EXPECT_EQ(history["operations"][0]["sequence"], 6);
  const std::string author = history["operations"][0]["author"];
  EXPECT_FALSE(author.empty()) << "of a local socket it is the account";
  test::Process for_people({HANDLOFT_MODELD, "history", model}, folder / "log");
  EXPECT_THAT(for_people.read_all(patience),
              testing::HasSubstr(author + " (client " + history["operations"][0]["client"].dump() + ")  "));
  EXPECT_THAT(history["operations"][0]["words"].get<std::string>(), testing::HasSubstr("12 points"));
  const auto [checked, verified] = command({"verify", model, "--replay"});
  EXPECT_EQ(checked, 0);
  EXPECT_EQ(verified["hash"], hash);

  const auto [exported, step] = command({"export", model, (folder / "seat.step").string()});
  EXPECT_EQ(exported, 0) << step;
  EXPECT_EQ(step["hash"], hash);
  EXPECT_GT(fs::file_size(folder / "seat.step"), 1000U);
  EXPECT_EQ(command({"export", model, (folder / "early.step").string(), "--at", "3"}).first, 1)
      << "nothing was fitted";
  // As a script it makes the same model again.
  const std::string script = (folder / "seat.jsonl").string();
  EXPECT_EQ(command({"export", model, script}).second["operations"], 7);
  std::ofstream(script, std::ios::app) << R"({"query": {"hash": {}}})"
                                       << "\n";
  test::Process run({HANDLOFT_MODELD, "run", script}, folder / "log");
  EXPECT_THAT(run.read_all(patience), testing::HasSubstr(hash));
  EXPECT_EQ(run.wait(patience), 0);

  // One bit of the fifth stroke: its coordinates are in the file as they are.
  std::string bytes;
  {
    std::ifstream in(model, std::ios::binary);
    bytes.assign(std::istreambuf_iterator<char>(in), {});
  }
  const double y = 0.01 * 4 + 0.003;
  const std::size_t at = bytes.find(std::string(reinterpret_cast<const char*>(&y), sizeof y));
  ASSERT_NE(at, std::string::npos);
  bytes[at] = static_cast<char>(bytes[at] ^ 1);
  std::ofstream(model, std::ios::binary) << bytes;
  // A list tells what the files say; whether they are good is asked for.
  EXPECT_EQ(command({"models", folder.string()}).first, 0);
  const auto [found, checked_list] = command({"models", folder.string(), "--verify"});
  EXPECT_EQ(found, 1);
  EXPECT_THAT(checked_list["models"][0]["problem"].get<std::string>(), testing::HasSubstr("operation "));
  const auto [bad, damage] = command({"verify", model});
  EXPECT_EQ(bad, 1);
  EXPECT_EQ(damage["damages"][0]["where"], "operation 5");
  test::Process refused(serve(), folder / "log");
  EXPECT_EQ(refused.wait(patience), 1);
  EXPECT_THAT(refused.error_output(), testing::HasSubstr("operation 5"));
  const auto [mended, repaired] = command({"repair", model});
  EXPECT_EQ(mended, 0);
  EXPECT_EQ(repaired["operations"], 4);
  EXPECT_EQ(command({"verify", (folder / "seat.repaired.handloft").string(), "--replay"}).first, 0);
  std::string after;
  {
    std::ifstream in(model, std::ios::binary);
    after.assign(std::istreambuf_iterator<char>(in), {});
  }
  EXPECT_EQ(after, bytes) << "the damaged file is never written";
}

TEST_F(StoreProcess, U1AScriptOfSeveralClientsMakesTheSameModel) {
  std::string hash;
  test::Process server(serve(), folder / "log");
  ASSERT_TRUE(server.read_line(patience)) << server.error_output();
  {
    RemoteTarget editors[] = {connect(), connect(net::random_client_key())};
    v1::Operation create, rename, undo, comment;
    for (const char* id : {"sa", "sb"}) {
      create.mutable_create_dual_shape()->set_id(id);
      ASSERT_TRUE(editors[id[1] - 'a'].submit(create).ok());
    }
    rename.mutable_rename()->set_name("named");
    for (const char* id : {"sa", "sb"}) {
      rename.mutable_rename()->set_entity(id);
      ASSERT_TRUE(editors[id[1] - 'a'].submit(rename).ok());
    }
    comment.mutable_add_comment()->set_text("too thin");
    comment.mutable_add_comment()->mutable_place()->set_x(-0.0);
    ASSERT_TRUE(editors[1].submit(comment).ok());
    undo.mutable_undo();
    ASSERT_TRUE(editors[0].submit(undo).ok());
    hash = hash_of(editors[0]);
  }
  const std::string script = (folder / "shapes.jsonl").string();
  EXPECT_EQ(command({"export", model, script}).second["operations"], 6);
  const std::string ask_names =
      R"({"expect": {"query": {"entities": {}}, "path": "entities.entities.0.name", "equals": "sa"}})";
  std::ofstream(script, std::ios::app) << ask_names << "\n"
                                       << R"({"query": {"hash": {}}})"
                                       << "\n";
  test::Process alone({HANDLOFT_MODELD, "run", script}, folder / "log2");
  EXPECT_THAT(alone.read_all(patience), testing::HasSubstr(hash));
  EXPECT_EQ(alone.wait(patience), 0) << alone.error_output();

  // A server takes it as one client's, whose newest step is another one.
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(patience), 0) << server.error_output();
  model = (folder / "other.handloft").string();
  test::Process other(serve(), folder / "log");
  ASSERT_TRUE(other.read_line(patience)) << other.error_output();
  test::Process connected({HANDLOFT_MODELD, "run", script, "--connect", socket()}, folder / "log2");
  connected.read_all(patience);
  EXPECT_EQ(connected.wait(patience), 1);
  EXPECT_THAT(connected.error_output(), testing::HasSubstr("line 6: failed_precondition: client_id: "));
  other.signal(SIGTERM);
  EXPECT_EQ(other.wait(patience), 0) << other.error_output();

  // Of one client alone it is run there, too.
  std::ifstream all(script);
  const std::string only = (folder / "only.jsonl").string();
  {
    std::ofstream of_one(only);
    for (std::string line; std::getline(all, line);)
      if (line.find("\"sb\"") == std::string::npos && line.find("addComment") == std::string::npos &&
          line.find("hash") == std::string::npos)
        of_one << line << "\n";
  }
  model = (folder / "third.handloft").string();
  test::Process third(serve(), folder / "log");
  ASSERT_TRUE(third.read_line(patience)) << third.error_output();
  test::Process one({HANDLOFT_MODELD, "run", only, "--connect", socket()}, folder / "log2");
  one.read_all(patience);
  EXPECT_EQ(one.wait(patience), 0) << one.error_output();
  third.signal(SIGTERM);
  EXPECT_EQ(third.wait(patience), 0) << third.error_output();
}

// SQLite takes a write-ahead log up to its first damage and says nothing of the rest: no command may show
// that as if it were all (D4).
TEST_F(StoreProcess, D4NoCommandPassesOverWhatWasSavedAndIsGone) {
  test::Process server(serve(), folder / "server.log");
  ASSERT_TRUE(server.read_line(patience)) << server.error_output();
  {
    auto target = connect();
    for (int i = 0; i < 5; ++i) ASSERT_TRUE(target.submit(stroke(i)).ok());
  }
  server.signal(SIGKILL);
  ASSERT_TRUE(server.wait(patience));
  const std::string copy = (folder / "copy.handloft").string(), obj = (folder / "seat.obj").string(),
                    script = (folder / "seat.jsonl").string();
  EXPECT_EQ(command({"history", model}).first, 0);
  fs::remove(model + "-wal");
  EXPECT_EQ(command({"verify", model}).first, 1);
  EXPECT_EQ(command({"backup", model, copy}).first, 1);
  EXPECT_THAT(complaint_of_last(), testing::HasSubstr("was saved"));
  for (const std::string& to : {obj, script}) {
    EXPECT_EQ(command({"export", model, to}).first, 1);
    EXPECT_THAT(complaint_of_last(), testing::HasSubstr("was saved"));
  }
  for (const std::string& made : {copy, obj, script}) EXPECT_FALSE(fs::exists(made)) << made;
  const auto [history, told] = command({"history", model});
  EXPECT_EQ(history, 1);
  EXPECT_THAT(told.value("problem", ""), testing::HasSubstr("was saved"));
  const auto [models, listed] = command({"models", folder.string()});
  EXPECT_EQ(models, 1);
  EXPECT_THAT(listed["models"][0].value("problem", ""), testing::HasSubstr("was saved"));
}

TEST_F(StoreProcess, D1AModelWhoseFileIsRemovedTakesNoMoreAndTheLogSaysSo) {
  test::Process server(serve(), folder / "server.log");
  ASSERT_TRUE(server.read_line(patience)) << server.error_output();
  auto target = connect();
  ASSERT_TRUE(target.submit(stroke(0)).ok());
  fs::remove(model);
  // The first is refused by the disk, and whatever comes then at once.
  EXPECT_TRUE(test::eventually([&] {
    const auto refused = target.submit(stroke(1));
    return !refused && refused.error().message.find("removed or moved") != std::string::npos;
  }));
  EXPECT_TRUE(test::eventually([&] {
    return server.error_output().find("takes no more operations") != std::string::npos;
  })) << server.error_output();
  server.signal(SIGTERM);
  EXPECT_EQ(server.wait(patience), 1);
  EXPECT_THAT(server.error_output(), testing::HasSubstr("ends without its last operations"));
}

TEST_F(StoreProcess, D1NoExportWritesOverAnotherModel) {
  {
    test::Process server(serve(), folder / "server.log");
    ASSERT_TRUE(server.read_line(patience)) << server.error_output();
    ASSERT_TRUE(connect().submit(stroke(0)).ok());
    server.signal(SIGTERM);
    ASSERT_EQ(server.wait(patience), 0);
  }
  const std::string other = (folder / "other.jsonl").string();
  fs::copy_file(model, other);
  const auto size = fs::file_size(other);
  for (const std::string& from : {model, other}) {
    EXPECT_EQ(command({"export", from, other}).first, 1);
    EXPECT_THAT(complaint_of_last(), testing::HasSubstr("is a model"));
  }
  EXPECT_EQ(fs::file_size(other), size);
}

TEST_F(StoreProcess, AnAnswerThatCannotBeWrittenIsAFailure) {
  const int full = ::open("/dev/full", O_WRONLY | O_CLOEXEC);
  if (full < 0) GTEST_SKIP() << "there is no /dev/full here";
  ::close(full);
  const int status = std::system((std::string(HANDLOFT_MODELD) + " models " + folder.string() +
                                  " > /dev/full 2> " + (folder / "log").string())
                                     .c_str());
  EXPECT_EQ(WEXITSTATUS(status), 1);
  EXPECT_THAT(complaint_of_last(), testing::HasSubstr("cannot write the answer"));
}

// Undo went by other rules when the first of them were written: the same model comes of the script, or none.
TEST_F(StoreProcess, ScriptsOfReleasedFormatsMakeTheSameModels) {
  std::vector<std::string> refused;
  int made = 0;
  for (const auto& format : fs::directory_iterator("tests/data")) {
    if (!format.path().filename().string().starts_with("models_v")) continue;
    for (const auto& entry : fs::directory_iterator(format)) {
      if (entry.path().extension() != ".handloft") continue;
      // A copy: to be read it may need files beside it.
      for (const char* rest : {"", "-mark", "-wal"}) {
        const fs::path from = entry.path().string() + rest;
        fs::remove(folder / (std::string("copy.handloft") + rest));
        if (fs::exists(from)) fs::copy_file(from, folder / (std::string("copy.handloft") + rest));
      }
      const std::string copy = (folder / "copy.handloft").string();
      const std::string script = (folder / "copy.jsonl").string();
      const Json verified = command({"verify", copy, "--replay"}).second;
      const int status = command({"export", copy, script}).first;
      if (status != 0) {
        refused.push_back(format.path().filename() / entry.path().filename());
        continue;
      }
      std::ofstream(script, std::ios::app) << R"({"query": {"hash": {}}})"
                                           << "\n";
      test::Process run({HANDLOFT_MODELD, "run", script}, folder / "log");
      EXPECT_THAT(run.read_all(patience), testing::HasSubstr(verified["hash"].get<std::string>()))
          << entry.path();
      EXPECT_EQ(run.wait(patience), 0) << entry.path() << run.error_output();
      ++made;
    }
  }
  EXPECT_GE(made, 12);
  EXPECT_THAT(refused, testing::ElementsAre("models_v2/continued.handloft"));
}

TEST_F(StoreProcess, U6TheCommandsKnowTheVersionsThatTheModelHas) {
  const auto named = [](const std::string& name) {
    v1::Operation operation;
    operation.mutable_name_version()->set_name(name);
    return operation;
  };
  v1::Operation fit, undo, redo;
  fit.mutable_fit()->set_entity("seat");
  undo.mutable_undo();
  redo.mutable_redo();
  std::string hash;
  std::uint64_t sequence = 0;
  {
    test::Process server(serve(), folder / "log");
    ASSERT_TRUE(server.read_line(patience)) << server.error_output();
    auto editor = connect();
    ASSERT_TRUE(editor.submit(stroke(0)).ok());
    ASSERT_TRUE(editor.submit(fit).ok());
    const auto done = editor.submit(named("first"));
    ASSERT_TRUE(done.ok()) << done.error().describe();
    sequence = done->sequence;
    hash = hash_of(editor);
    // Taken back and named again; and one that stays taken back.
    ASSERT_TRUE(editor.submit(undo).ok());
    ASSERT_TRUE(editor.submit(redo).ok());
    ASSERT_TRUE(editor.submit(stroke(1)).ok());
    ASSERT_TRUE(editor.submit(named("second")).ok());
    ASSERT_TRUE(editor.submit(undo).ok());
    server.signal(SIGTERM);
    EXPECT_EQ(server.wait(patience), 0) << server.error_output();
  }
  const Json versions = command({"models", folder.string()}).second["models"][0]["versions"];
  ASSERT_EQ(versions.size(), 1U) << versions;
  EXPECT_EQ(versions[0]["name"], "first");
  EXPECT_EQ(versions[0]["sequence"], sequence);
  EXPECT_EQ(versions[0]["alternative"], "main");
  const Json history = command({"history", model}).second;
  EXPECT_EQ(history["versions"], versions);
  ASSERT_EQ(history["alternatives"].size(), 1U);
  EXPECT_EQ(history["alternatives"][0]["version"], "first");

  const auto [exported, step] =
      command({"export", model, (folder / "first.step").string(), "--named", "first"});
  EXPECT_EQ(exported, 0) << step;
  EXPECT_EQ(step["sequence"], sequence);
  EXPECT_EQ(step["hash"], hash);
  EXPECT_EQ(
      command({"export", model, (folder / "first.jsonl").string(), "--named", "first"}).second["operations"],
      sequence);

  // What the model does not have is refused by the option's name, and nothing is written.
  const std::string none = (folder / "none.jsonl").string();
  for (const auto& [words, complaint] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"export", model, none, "--named", "second"}, "--named: found \"second\", expected"},
           {{"export", model, none, "--named", ""}, "--named: found nothing, expected"},
           {{"export", model, none, "--named", "first", "--at", "2"}, "--at: found both"},
           {{"export", model, none, "--at", "9"}, "--at: found 9, expected 1 to 8,"},
           {{"history", model, "--from", "999"}, "--from: found 999, expected 1 to 8,"}}) {
    EXPECT_EQ(command(words).first, 2) << complaint;
    EXPECT_THAT(complaint_of_last(), testing::HasSubstr(complaint));
    EXPECT_FALSE(fs::exists(none)) << complaint;
  }
  EXPECT_EQ(command({"export", model, none, "--at", "8"}).second["operations"], 8);
  EXPECT_EQ(command({"history", model, "--from", "8"}).second["operations"].size(), 1U);

  // What is repaired has them, too.
  EXPECT_EQ(command({"repair", model}).first, 0);
  const Json all = command({"models", folder.string()}).second["models"];
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0]["versions"], all[1]["versions"]);
}

// Of two users, in the words of both.
TEST_F(StoreProcess, HistoryTellsTheAuthorThatAScriptHasToo) {
  fs::copy_file("tests/data/models_v2/annotated.handloft", model);
  const Json operations = command({"history", model}).second["operations"];
  const std::string script = (folder / "annotated.jsonl").string();
  ASSERT_EQ(command({"export", model, script}).first, 0);
  std::ifstream lines(script);
  std::set<std::string> authors;
  for (const Json& operation : operations) {
    std::string line;
    ASSERT_TRUE(std::getline(lines, line));
    EXPECT_EQ(Json::parse(line)["author"], operation["author"]);
    authors.insert(operation["author"].get<std::string>());
  }
  EXPECT_GT(authors.size(), 1U);
}

TEST_F(StoreProcess, WhatIsNoModelIsSaidSo) {
  std::ofstream(folder / "letter.handloft") << "Dear Sir or Madam, this is no model.";
  EXPECT_EQ(command({"verify", (folder / "letter.handloft").string()}).first, 1);
  EXPECT_EQ(command({"history", (folder / "none.handloft").string()}).first, 1);
  EXPECT_EQ(command({"history"}).first, 2);
  EXPECT_EQ(command({"models", (folder / "none").string()}).first, 1);
}

}  // namespace
}  // namespace handloft::session
