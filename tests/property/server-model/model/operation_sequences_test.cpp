// Random sequences of all operations: none leaves NaN or breaks an invariant of the document (X5, A12), and
// undoing them one by one gives back every document to the bit, by its canonical hash (A28).

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "any_sequence.h"
#include "document_invariants.h"
#include "server-model/model/canonical.h"
#include "server-model/model/model.h"
#include "state_round_trip.h"
#include "tests/support/build_kind.h"

namespace handloft::model {
namespace {

namespace v1 = handloft::v1;

/// 1,000 sequences of up to 60 operations, which are some 0.7 s here; a sanitized build is ten
/// times as slow, and does a tenth.
constexpr int cases = 100;
constexpr int sequences_per_case = handloft::test::sanitized ? 1 : 10;
using test::longest_sequence;
using test::Made;
using test::Maker;
using test::own_makers;

TEST(OperationSequences, A28X5KeepEveryInvariantAndUndoToTheBit) {
  std::map<std::string, int> applied;
  int sequences = 0;
  std::size_t longest = 0;
  EXPECT_TRUE(rc::check([&] {
    for (int round = 0; round < sequences_per_case; ++round) {
      Model model;
      v1::Operation undo;
      undo.mutable_undo();
      // The hashes on the way from the empty document to the present one.
      std::vector<std::string> path{document_hash(model.document())};
      std::vector<std::string> undone;
      const std::vector<Made> sequence = test::any_sequence();
      ++sequences;
      longest = std::max(longest, sequence.size());
      for (const Made& made : sequence) {
        const auto submitted = model.submit(made.operation);
        const std::string hash = document_hash(model.document());
        if (!submitted || submitted->sequence == 0) {
          RC_ASSERT(hash == path.back());
          continue;
        }
        ++applied[made.name];
        const std::string broken = test::broken_invariant(model.document(), model.limits());
        if (!broken.empty()) RC_FAIL(std::string(made.name) + " left " + broken);
        if (made.operation.has_undo()) {
          undone.push_back(path.back());
          path.pop_back();
          RC_ASSERT(hash == path.back());
        } else if (made.operation.has_redo()) {
          RC_ASSERT(hash == undone.back());
          path.push_back(undone.back());
          undone.pop_back();
        } else {
          path.push_back(hash);
          undone.clear();
        }
      }
      RC_ASSERT(test::broken_round_trip(model) == "");
      while (path.size() > 1) {
        RC_ASSERT(model.submit(undo).ok());
        path.pop_back();
        RC_ASSERT(document_hash(model.document()) == path.back());
      }
      RC_ASSERT(!model.submit(undo).ok());
    }
  }));
  // The sequences must reach what they are meant to reach.
  EXPECT_GE(sequences, cases * sequences_per_case);
  EXPECT_GE(longest, static_cast<std::size_t>(longest_sequence - 4));
  for (const Maker& maker : own_makers) EXPECT_GE(applied[maker.name], sequences_per_case) << maker.name;
}

}  // namespace
}  // namespace handloft::model
