// One stroke over several surfaces (A21).

#include <gtest/gtest.h>

#include <array>

#include "profile_helpers.h"
#include "server-model/geometry/resample.h"

namespace handloft::model::test {
namespace {

TEST(ModifyProfile, A21_AStrokeDividesItselfAndTheEffectiveOperationSaysWhere) {
  const Document before = two_tiles();
  const auto across = line({-0.08, 0, 0.03}, {0.08, 0.005, 0.03});
  const ApplyResult result = must(before, profile({curve(across)}));
  EXPECT_EQ(result.changes.changed, (std::vector<std::string>{"left", "right"}));
  EXPECT_EQ(result.words, "Draw the profile of \"left\", \"right\"");
  EXPECT_TRUE(result.notes.empty());
  const auto& effective = result.effective.modify_profile().curves(0);
  ASSERT_EQ(effective.split_at_size(), 1);
  EXPECT_NEAR(effective.split_at(0), 0.5, 0.03);
  EXPECT_EQ(effective.split_entities(0), "left");
  EXPECT_EQ(effective.split_entities(1), "right");
  EXPECT_TRUE(effective.entity().empty());
  // The replay decides nothing anew: the same, to the bit, and the same effective operation again.
  const ApplyResult replay = must(before, result.effective);
  EXPECT_EQ(document_hash(replay.document), document_hash(result.document));
  EXPECT_EQ(replay.effective.SerializeAsString(), result.effective.SerializeAsString());
}

TEST(ModifyProfile, A21_ATwoSurfaceStrokeIsTwoSeparateEditsBitwise) {
  const Document before = two_tiles();
  const auto across = line({-0.08, 0, 0.03}, {0.08, 0.005, 0.02});
  for (const bool keep : {false, true}) {
    const ApplyResult at_once = must(before, profile({curve(across)}, keep));
    const double at = at_once.effective.modify_profile().curves(0).split_at(0);

    std::vector<Vec3> drawn;
    for (const auto& p : across) drawn.push_back({p.position().x(), p.position().y(), p.position().z()});
    const auto parts = geometry::split_curve(drawn, std::array{at});
    Document one_by_one = before;
    for (const auto& [k, id] : {std::pair{0U, "left"}, std::pair{1U, "right"}}) {
      std::vector<v1::Point> part;
      for (const Vec3& p : (*parts)[k]) {
        part.push_back(point(p.x(), p.y(), p.z(), 0.7));
        part.back().set_time_ns(59000);
      }
      one_by_one = must(one_by_one, profile({curve(part, id)}, keep)).document;
    }
    EXPECT_EQ(document_hash(one_by_one), document_hash(at_once.document));

    // The other way to say it: each part for itself, the other one nobody's.
    Document by_division = before;
    for (int k = 0; k < 2; ++k) {
      v1::Operation part = at_once.effective;
      part.mutable_modify_profile()->mutable_curves(0)->set_split_entities(1 - k, "");
      by_division = must(by_division, part).document;
    }
    EXPECT_EQ(document_hash(by_division), document_hash(at_once.document));
  }
}

TEST(ModifyProfile, A21_OnlyAmongTheNamedEntities) {
  auto operation = profile({curve(line({-0.08, 0, 0.03}, {0.08, 0, 0.03}))});
  operation.mutable_modify_profile()->add_entities("right");
  const ApplyResult result = must(two_tiles(), operation);
  EXPECT_EQ(result.changes.changed, (std::vector<std::string>{"right"}));
}

TEST(ModifyProfile, A21_WhatIsNearNobodyChangesNothingAndIsNoted) {
  const Document before = two_tiles();
  const ApplyResult far = must(before, profile({curve(line({-0.05, 0, 0.5}, {0.05, 0, 0.5}))}));
  EXPECT_TRUE(far.changes.empty());
  ASSERT_EQ(far.notes.size(), 1U);
  EXPECT_NE(far.notes[0].find("changes nothing"), std::string::npos) << far.notes[0];
  EXPECT_TRUE(must(before, far.effective).changes.empty());

  const ApplyResult half = must(before, profile({curve(line({0.05, 0, 0.02}, {1, 0, 0.02}))}));
  EXPECT_EQ(half.changes.changed, (std::vector<std::string>{"right"}));
  ASSERT_EQ(half.notes.size(), 1U);
  EXPECT_NE(half.notes[0].find("% of curve 1"), std::string::npos) << half.notes[0];
}

}  // namespace
}  // namespace handloft::model::test
