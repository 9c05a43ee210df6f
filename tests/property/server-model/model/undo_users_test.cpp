// C2, U1: undo touches only one's own work. Random operations of every kind by two to eight clients, with
// undo and redo, against a book that the test keeps by itself: who has changed what last, by identity of the
// values. 1,000 cases; HANDLOFT_LONG=1: 100,000; a sanitized build a twentieth of the first.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "any_sequence.h"
#include "document_invariants.h"
#include "server-model/model/canonical.h"
#include "server-model/model/model.h"
#include "state_round_trip.h"
#include "tests/support/build_kind.h"
#include "tests/support/property_cases.h"

namespace handloft::model {
namespace {

namespace v1 = handloft::v1;
using test::in_range;

const int cases = std::getenv("HANDLOFT_LONG") != nullptr ? 100'000 : handloft::test::sanitized ? 50 : 1'000;

/// One case a check: of a failing one RapidCheck then shrinks that case alone, in seconds. Several in one
/// check would be shrunk together, for hours. Before main(), as `seeded`.
const bool counted = handloft::test::take_cases(cases);

/// Everything that a step may change, one key each, with the identity of its value.
using Key = std::pair<std::string, std::string>;
using Value = std::shared_ptr<const void>;
using Flat = std::map<Key, Value>;

Flat flat(const Document& document) {
  Flat all;
  for (const Alternative& alternative : *document.alternatives) {
    for (const auto& [id, entity] : alternative.entities ? *alternative.entities : document.entities)
      all[{alternative.name, id}] = entity;
  }
  for (const auto& [name, version] : *document.versions) all[{"a version", name}] = version;
  for (const auto& [id, comment] : *document.comments) all[{"a comment", id}] = comment;
  return all;
}

struct Change {
  Value before, after;  ///< Null: there was none.
};
using Changed = std::map<Key, Change>;

Changed changed(const Flat& before, const Flat& after) {
  Changed all;
  for (const auto& [key, value] : before) {
    const auto now = after.find(key);
    if (now == after.end()) {
      all[key] = {value, nullptr};
    } else if (now->second != value) {
      all[key] = {value, now->second};
    }
  }
  for (const auto& [key, value] : after) {
    if (!before.contains(key)) all[key] = {nullptr, value};
  }
  return all;
}

struct Step {
  Changed changes;
  std::size_t done;  ///< So many things had been done before it.
};

/// Who did what, and whose the newest change of each key is.
class Book {
 public:
  void add(std::uint64_t client, Changed changes) {
    undone_[client].clear();
    const std::size_t number = steps_.size();
    for (const auto& [key, change] : changes) newest_[key].push_back(number);
    standing_[client].push_back(number);
    steps_.push_back({std::move(changes), acts_.size()});
    acts_.push_back(client);
  }

  /// What is wrong with what an undo has changed; empty: nothing.
  std::string undone(std::uint64_t client, const Changed& changes) {
    if (standing_[client].empty()) return "nothing was there to be taken back";
    const std::size_t number = standing_[client].back();
    std::string wrong = compare(number, changes, [](const Change& change) { return change.before; });
    if (!wrong.empty()) return wrong;
    for (const auto& [key, change] : steps_[number].changes) newest_[key].pop_back();
    standing_[client].pop_back();
    undone_[client].push_back(number);
    acts_.push_back(client);
    return {};
  }

  std::string redone(std::uint64_t client, const Changed& changes) {
    if (undone_[client].empty()) return "nothing was there to be done again";
    const std::size_t number = undone_[client].back();
    for (const auto& [key, change] : changes) {
      const auto step = steps_[number].changes.find(key);
      if (step == steps_[number].changes.end()) return "a redo changed what its step had not";
      if (step->second.after != change.after) return "a redo left another value";
      if (step->second.before != change.before) return "a redo changed another value";
      const std::vector<std::size_t>& newest = newest_[key];
      if (!newest.empty() && newest.back() > number) return "a redo changed what somebody has changed since";
    }
    for (const auto& [key, change] : steps_[number].changes) newest_[key].push_back(number);
    undone_[client].pop_back();
    standing_[client].push_back(number);
    steps_[number].done = acts_.size();
    acts_.push_back(client);
    return {};
  }

  std::size_t standing(std::uint64_t client) { return standing_[client].size(); }
  std::size_t taken_back(std::uint64_t client) { return undone_[client].size(); }
  /// Whether anybody else has done anything since the client's newest step: else it may not be refused.
  bool gone_on(std::uint64_t client) {
    const std::size_t done = steps_[standing_[client].back()].done;
    return std::any_of(acts_.begin() + static_cast<std::ptrdiff_t>(done), acts_.end(),
                       [&](std::uint64_t other) { return other != client; });
  }

 private:
  template <typename Wanted>
  std::string compare(std::size_t number, const Changed& changes, const Wanted& wanted) {
    for (const auto& [key, change] : changes) {
      const auto step = steps_[number].changes.find(key);
      if (step == steps_[number].changes.end())
        return fmt::format("an undo changed {} of {}, which its step had not", key.second, key.first);
      if (change.after != wanted(step->second)) return "an undo left another value than that before the step";
      if (newest_[key].back() != number) return "an undo changed what somebody else had changed last";
    }
    for (const auto& [key, change] : steps_[number].changes) {
      if (!changes.contains(key)) return "an undo left something that its step had changed";
    }
    return {};
  }

  std::vector<Step> steps_;
  std::vector<std::uint64_t> acts_;  ///< Whose was each thing that was done, undo and redo among them.
  std::map<Key, std::vector<std::size_t>> newest_;
  std::map<std::uint64_t, std::vector<std::size_t>> standing_, undone_;
};

struct Counts {
  std::size_t accepted = 0, refused = 0, redone = 0, redo_refused = 0;
};

v1::Operation undo_by(std::uint64_t client) {
  v1::Operation operation;
  operation.mutable_undo();
  operation.set_client_id(client);
  return operation;
}

v1::Operation redo_by(std::uint64_t client) {
  v1::Operation operation;
  operation.mutable_redo();
  operation.set_client_id(client);
  return operation;
}

/// Refused: nothing has changed, and the words say who is in the way.
void must_be_refused(const Model& model, const std::string& hash, const Error& error,
                     const std::string& announced, bool others) {
  RC_ASSERT(document_hash(model.document()) == hash);
  RC_ASSERT(error.code == ErrorCode::failed_precondition);
  RC_ASSERT(error.message == announced);
  RC_ASSERT(others);
  RC_ASSERT(error.message.find("client ") != std::string::npos ||
            error.message.find("has changed since") != std::string::npos);
}

void one_case(Counts& counts) {
  const auto clients = static_cast<std::uint64_t>(in_range(2, 9));
  Model model;
  Book book;
  for (test::Made& made : test::any_sequence()) {
    const std::uint64_t client = 1 + static_cast<std::uint64_t>(in_range(0, static_cast<int>(clients)));
    // Undo is what this is about.
    v1::Operation operation = std::move(made.operation);
    if (const int what = in_range(0, 6); what == 0)
      operation = undo_by(client);
    else if (what == 1)
      operation = redo_by(client);
    operation.set_client_id(client);
    const bool undo = operation.has_undo(), redo = operation.has_redo();
    const std::string hash = document_hash(model.document());
    const Flat before = flat(model.document());
    const std::string announced = undo   ? model.history().undo_refused(client)
                                  : redo ? model.history().redo_refused(client)
                                         : std::string();
    const auto submitted = model.submit(operation);
    if (!submitted) {
      RC_ASSERT(document_hash(model.document()) == hash);
      if (undo && book.standing(client) > 0) {
        ++counts.refused;
        must_be_refused(model, hash, submitted.error(), announced, book.gone_on(client));
      }
      if (redo && book.taken_back(client) > 0) {
        ++counts.redo_refused;
        must_be_refused(model, hash, submitted.error(), announced, true);
      }
      continue;
    }
    if (submitted->sequence == 0) continue;
    RC_ASSERT(announced == "");
    const Changed changes = changed(before, flat(model.document()));
    const std::string broken = test::broken_invariant(model.document(), model.limits());
    if (!broken.empty()) RC_FAIL(std::string(made.name) + " left " + broken);
    if (undo) {
      ++counts.accepted;
      RC_ASSERT(book.undone(client, changes) == "");
      // There and back is nothing.
      const std::string taken_back = document_hash(model.document());
      RC_ASSERT(model.submit(redo_by(client)).ok());
      RC_ASSERT(document_hash(model.document()) == hash);
      RC_ASSERT(model.submit(undo_by(client)).ok());
      RC_ASSERT(document_hash(model.document()) == taken_back);
    } else if (redo) {
      ++counts.redone;
      RC_ASSERT(book.redone(client, changes) == "");
    } else {
      book.add(client, changes);
    }
    RC_ASSERT(model.history().undo_steps(client) == book.standing(client));
    RC_ASSERT(model.history().redo_steps(client) == book.taken_back(client));
  }
  RC_ASSERT(test::broken_round_trip(model) == "");
}

TEST(UndoOfUsers, C2U1_TouchesOnlyOnesOwnWork) {
  Counts counts;
  int rounds = 0;
  ASSERT_TRUE(counted);
  ASSERT_TRUE(rc::check([&] {
    ++rounds;
    one_case(counts);
  }));
  EXPECT_GE(rounds, cases);
  // All of it must have happened.
  const auto at_least = static_cast<std::size_t>(cases);
  EXPECT_GT(counts.accepted, at_least);
  EXPECT_GT(counts.refused, at_least / 4);
  EXPECT_GT(counts.redone, at_least / 10);
  EXPECT_GT(counts.redo_refused, at_least / 100);
  fmt::print("{} cases: {} undone, {} refused, {} redone, {} refused\n", rounds, counts.accepted,
             counts.refused, counts.redone, counts.redo_refused);
}

}  // namespace
}  // namespace handloft::model
