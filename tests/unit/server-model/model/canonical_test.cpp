// The canonical form and its hash (X2).

#include "server-model/model/canonical.h"

#include <set>

#include "tests/unit/server-model/model/model_helpers.h"

namespace handloft::model {
namespace {

using namespace test;

TEST(CanonicalForm, TheEmptyDocumentHasAKnownHash) {
  // sha256 of: u64 17, "handloft document", u32 1, u64 0, u64 0, u64 1, u64 0 (the present alternative), u64
  // 1 (how many there are), u64 4, "main", u8 0; little-endian.
  EXPECT_EQ(canonical_bytes({}).size(), 8U + 17 + 4 + 8 + 8 + 8 + 8 + 8 + 8 + 4 + 1);
  EXPECT_EQ(document_hash({}), "00c248f792772011ae564c3b09da2c6d944be9d5a06fd71d2f7273d2197780a3");
}

TEST(CanonicalForm, DoesNotDependOnTheWayThere) {
  const Document once = applied({}, {create("a"), create("b"), add("a", saddle_points()), rename("b", "B")});
  const Document other =
      applied({}, {create("b"), rename("b", "C"), create("a"), rename("b", "B"), add("a", saddle_points())});
  EXPECT_EQ(canonical_bytes(once), canonical_bytes(other));
  EXPECT_EQ(document_hash(once), document_hash(other));
  EXPECT_NE(document_hash(once), document_hash({}));
}

TEST(CanonicalForm, EveryPropertyShows) {
  const Document base = applied({}, {create("a"), add("a", saddle_points(0.01)), fit("a")});
  std::vector<v1::Point> nudged = saddle_points(0.01);
  nudged[7].mutable_position()->set_z(std::nextafter(nudged[7].position().z(), 1.0));
  auto later = saddle_points(0.01);
  later[3].set_time_ns(1);
  std::set<std::string> hashes{document_hash(base)};
  std::size_t count = 1;
  const auto expect_new = [&](const Document& document) {
    hashes.insert(document_hash(document));
    EXPECT_EQ(hashes.size(), ++count);
  };
  expect_new(applied(base, {rename("a", "A")}));
  expect_new(applied(base, {superellipse("a", 2.5)}));
  expect_new(applied(base, {represent("a", v1::REPRESENTATION_POINTS)}));
  expect_new(applied(base, {symmetry("a", v1::SetSymmetry::PARTNER)}));
  expect_new(applied(base, {symmetry("a", v1::SetSymmetry::PARTNER, 1.0)}));
  expect_new(applied(base, {symmetry("a", v1::SetSymmetry::SAME_SHAPE)}));
  expect_new(applied(base, {fit("a", 1)}));
  expect_new(applied(base, {add("a", {point(0, 0, 0)})}));
  expect_new(applied(base, {remove("a")}));
  expect_new(applied(base, {create("")}));
  expect_new(applied({}, {create("a"), add("a", saddle_points(0.01))}));
  expect_new(applied({}, {create("a"), add("a", nudged)}));
  expect_new(applied({}, {create("a"), add("a", later)}));
  expect_new(applied({}, {create("a", 1)}));
}

TEST(CanonicalForm, TheHashIsThatOfTheBytes) {
  // More than one block of the writer.
  Document document = applied({}, {create("a")});
  for (int i = 0; i < 80; ++i) document = applied(document, {add("a", saddle_points())});
  EXPECT_GT(canonical_bytes(document).size(), 100'000U);
  EXPECT_EQ(document_hash(document).size(), 64U);
  EXPECT_EQ(document_hash(document), document_hash(Document(document)));
}

}  // namespace
}  // namespace handloft::model
