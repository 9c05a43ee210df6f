// U1, D6: which steps a full history forgets, and that forgetting takes away nothing but that step's own
// undo. Against a book of counts that knows the rule alone; and of random operations of every kind by several
// clients, a server that restarts from snapshots against one that never did and one that forgets nothing.
// 1,000 cases; HANDLOFT_LONG=1: 20,000; a sanitized build a twentieth of the first.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <cstdlib>
#include <deque>
#include <map>
#include <string>
#include <utility>

#include "any_sequence.h"
#include "server-model/model/canonical.h"
#include "server-model/model/document_codec.h"
#include "server-model/model/model.h"
#include "tests/support/build_kind.h"
#include "tests/support/property_cases.h"

namespace handloft::model {
namespace {

namespace v1 = handloft::v1;
using test::in_range;

const int cases = std::getenv("HANDLOFT_LONG") != nullptr ? 20'000 : handloft::test::sanitized ? 50 : 1'000;

/// As in undo_users_test.cpp.
const bool counted = handloft::test::take_cases(cases);

/// As a snapshot gives it back.
History remembered(const History& history, std::size_t max_steps, std::size_t snapshot_steps) {
  EncodeOptions options;
  options.max_steps = snapshot_steps;
  options.min_shared_bytes = 1U << 30U;
  const auto bytes = encode_state(
      {history, 1}, [](auto, auto) { return Status(); }, options);
  if (!bytes) RC_FAIL(bytes.error().describe());
  auto state = decode_state(
      *bytes, [](auto) -> Result<std::string> { return make_error(ErrorCode::not_found, "part"); },
      max_steps);
  if (!state) RC_FAIL(state.error().describe());
  return std::move(state->history);
}

// --- which steps

/// The rule in a few lines: words of each client's steps, those that stand and those that are taken back.
class Book {
 public:
  explicit Book(std::size_t most) : most_(most) {}
  void push(std::uint64_t client, const std::string& words) {
    lines_[client].undone.clear();
    lines_[client].standing.push_back(words);
    while (all() > most_) forget(client);
  }
  void undo(std::uint64_t client) {
    Line& line = lines_[client];
    line.undone.push_front(line.standing.back());
    line.standing.pop_back();
  }
  void redo(std::uint64_t client) {
    Line& line = lines_[client];
    line.standing.push_back(line.undone.front());
    line.undone.pop_front();
  }
  struct Line {
    std::deque<std::string> standing, undone;
    std::size_t size() const { return standing.size() + undone.size(); }
  };
  const Line& line(std::uint64_t client) { return lines_[client]; }
  std::size_t clients() const {
    return static_cast<std::size_t>(
        std::count_if(lines_.begin(), lines_.end(), [](const auto& each) { return each.second.size() > 0; }));
  }

 private:
  std::size_t all() const {
    std::size_t count = 0;
    for (const auto& [client, line] : lines_) count += line.size();
    return count;
  }
  void forget(std::uint64_t pusher) {
    std::size_t most = 0;
    for (const auto& [client, line] : lines_) most = std::max(most, line.size());
    std::uint64_t whose = pusher;
    if (most == 1 || lines_[pusher].size() < most) {
      for (const auto& [client, line] : lines_) {
        if (line.size() != most || client == pusher) continue;
        whose = client;
        break;
      }
    }
    Line& line = lines_[whose];
    if (line.standing.empty()) {
      line.undone.pop_back();
    } else {
      line.standing.pop_front();
    }
  }
  std::map<std::uint64_t, Line> lines_;
  std::size_t most_;
};

v1::Operation create(std::uint64_t client, const std::string& id) {
  v1::Operation operation;
  operation.set_client_id(client);
  operation.mutable_create_dual_shape()->set_id(id);
  return operation;
}

void against_the_book(std::size_t& snapshots) {
  const auto most = static_cast<std::size_t>(in_range(1, 13));
  const auto clients = static_cast<std::uint64_t>(in_range(1, 6));
  const bool restarts = in_range(0, 2) == 0;
  History history({}, most);
  Book book(most);
  const int steps = in_range(10, 80);
  for (int i = 0; i < steps; ++i) {
    const auto client = static_cast<std::uint64_t>(in_range(0, static_cast<int>(clients)));
    const int what = in_range(0, 8);
    if (what < 2) {
      const Book::Line& line = book.line(client);
      const bool possible = what == 0 ? !line.standing.empty() : !line.undone.empty();
      const auto words = what == 0 ? history.undo(client) : history.redo(client);
      RC_ASSERT(words.ok() == possible);
      if (possible) what == 0 ? book.undo(client) : book.redo(client);
    } else {
      StepInfo info;
      info.words = fmt::format("step {}", i);
      info.client_id = client;
      const auto applied = apply(history.current(), create(client, fmt::format("e{}", i)));
      if (!applied) RC_FAIL(applied.error().describe());
      book.push(client, info.words);
      history.push(applied->document, info);
      // What each may count on.
      const std::size_t share = most / book.clients();
      for (std::uint64_t each = 0; each < clients; ++each) {
        const Book::Line& line = book.line(each);
        RC_ASSERT(line.size() == 0 || history.undo_steps(each) + history.redo_steps(each) == line.size());
      }
      RC_ASSERT(share == 0 || history.undo_steps(client) >= 1);
    }
    if (restarts && in_range(0, 5) == 0) {
      // Nothing is left out: all is as it was, to the bytes.
      history = remembered(history, most, most);
      ++snapshots;
    }
    RC_ASSERT(history.undo_steps() + history.redo_steps() <= most);
    for (std::uint64_t each = 0; each < clients; ++each) {
      const Book::Line& line = book.line(each);
      RC_ASSERT(history.undo_steps(each) == line.standing.size());
      RC_ASSERT(history.redo_steps(each) == line.undone.size());
      RC_ASSERT(history.next_undo(each) == (line.standing.empty() ? "" : line.standing.back()));
      RC_ASSERT(history.next_redo(each) == (line.undone.empty() ? "" : line.undone.front()));
    }
  }
}

TEST(Forgetting, U1_OfWhoHasMost) {
  std::size_t snapshots = 0;
  ASSERT_TRUE(counted);
  ASSERT_TRUE(rc::check([&] { against_the_book(snapshots); }));
  EXPECT_GT(snapshots, static_cast<std::size_t>(cases));
}

// --- and nothing else

struct Counts {
  std::size_t undone = 0, redone = 0, refused = 0, none_left = 0, restarts = 0, early = 0;
};

ApplyContext context_of(std::size_t max_steps) {
  ApplyContext context;
  context.limits.max_history_steps = max_steps;
  return context;
}

void no_more_than_its_own_undo(Counts& counts) {
  const auto clients = static_cast<std::uint64_t>(in_range(1, 5));
  const auto most = static_cast<std::size_t>(in_range(static_cast<int>(clients), 10));
  const auto kept = static_cast<std::size_t>(in_range(1, static_cast<int>(most) + 1));
  // Some of it by the rule before, which forgot the oldest of all.
  const int early = in_range(0, 3) == 0 ? in_range(1, 20) : 0;
  Model server({}, context_of(most)), steady({}, context_of(most)), elephant({}, context_of(10'000));
  int done = 0;
  std::string story = fmt::format("{} steps, {} in snapshots, {} by the rule before", most, kept, early);
  for (test::Made& made : test::any_sequence()) {
    v1::Operation operation = std::move(made.operation);
    if (const int what = in_range(0, 6); what < 2) {
      operation.Clear();
      what == 0 ? (void)operation.mutable_undo() : (void)operation.mutable_redo();
      made.name = what == 0 ? "undo" : "redo";
    }
    operation.set_client_id(static_cast<std::uint64_t>(in_range(0, static_cast<int>(clients))));
    const bool is_early = done < early;
    const UndoRule rule = is_early ? UndoRule::per_user_oldest_first : UndoRule::per_user;
    for (Model* const each : {&server, &steady, &elephant}) each->set_undo_rule(rule);
    if (!is_early && in_range(0, 8) == 0) {
      ++counts.restarts;
      story += "\nrestart";
      server = Model::restored({remembered(server.history(), most, kept), server.sequence(), {}},
                               context_of(most));
    }
    const auto submitted = server.submit(operation);
    if (!submitted && submitted.error().message.starts_with("there is nothing to ")) {
      ++counts.none_left;
      continue;
    }
    for (Model* const other : {&steady, &elephant}) {
      // By the rule before, who forgets differently may free numbers differently.
      if (other == &elephant && early > 0) continue;
      const auto same = other->submit(operation);
      const std::string what = fmt::format("{}\nclient {}: {}", story, operation.client_id(), made.name);
      if (submitted.ok() != same.ok())
        RC_FAIL(what + (submitted.ok() ? " refused: " + same.error().describe()
                                       : " not refused: " + submitted.error().describe()));
      if (document_hash(other->document()) != document_hash(server.document()))
        RC_FAIL(what + (other == &elephant ? " differs from what forgets nothing"
                                           : " differs from what was never restarted"));
    }
    const bool steps = operation.has_undo() || operation.has_redo();
    if (!submitted) {
      counts.refused += steps ? 1 : 0;
      continue;
    }
    if (submitted->sequence == 0) continue;
    ++done;
    story += fmt::format("\nclient {}: {}: {}", operation.client_id(), made.name, submitted->words);
    counts.early += is_early ? 1 : 0;
    counts.undone += operation.has_undo() ? 1 : 0;
    counts.redone += operation.has_redo() ? 1 : 0;
    RC_ASSERT(server.history().undo_steps() + server.history().redo_steps() <= most);
    for (std::uint64_t each = 0; each < clients; ++each) {
      RC_ASSERT(server.history().undo_steps(each) <= steady.history().undo_steps(each));
      RC_ASSERT(server.history().redo_steps(each) <= steady.history().redo_steps(each));
      if (server.history().undo_steps(each) > 0)
        RC_ASSERT(server.history().next_undo(each) == steady.history().next_undo(each));
      if (server.history().redo_steps(each) > 0)
        RC_ASSERT(server.history().next_redo(each) == steady.history().next_redo(each));
    }
  }
}

TEST(Forgetting, D6U1_TakesAwayNothingButTheStepsOwnUndo) {
  Counts counts;
  ASSERT_TRUE(rc::check([&] { no_more_than_its_own_undo(counts); }));
  const auto at_least = static_cast<std::size_t>(cases);
  EXPECT_GT(counts.undone, at_least);
  EXPECT_GT(counts.refused, at_least / 10);
  EXPECT_GT(counts.redone, at_least / 10);
  EXPECT_GT(counts.none_left, at_least);
  EXPECT_GT(counts.restarts, at_least);
  EXPECT_GT(counts.early, at_least);
  fmt::print("{} undone, {} redone, {} refused, {} with none left, {} restarts, {} by the rule before\n",
             counts.undone, counts.redone, counts.refused, counts.none_left, counts.restarts, counts.early);
}

}  // namespace
}  // namespace handloft::model
