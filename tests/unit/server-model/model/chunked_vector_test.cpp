#include "server-model/model/chunked_vector.h"

#include <gtest/gtest.h>

#include <numeric>
#include <thread>

namespace handloft::model {
namespace {

using Small = ChunkedVector<int, 4>;

Small counting(int count) {
  Small vector;
  for (int i = 0; i < count; ++i) vector.push_back(i);
  return vector;
}

std::vector<int> items(const Small& vector) {
  std::vector<int> result;
  for (const int item : vector) result.push_back(item);
  return result;
}

TEST(ChunkedVector, HoldsWhatWasAppendedAcrossChunks) {
  for (const int count : {0, 1, 3, 4, 5, 8, 13}) {
    std::vector<int> expected(static_cast<std::size_t>(count));
    std::iota(expected.begin(), expected.end(), 0);
    EXPECT_EQ(items(counting(count)), expected);
    Small at_once;
    at_once.append(expected);
    EXPECT_EQ(items(at_once), expected);
    EXPECT_EQ(at_once.chunk_count(), (expected.size() + 3) / 4);
  }
}

TEST(ChunkedVector, AppendingToACopyLeavesTheOriginal) {
  const Small original = counting(6);
  Small first = original;
  Small second = original;
  first.push_back(100);
  second.push_back(200);  // The slot is taken: this one copies its chunk.
  second.push_back(201);
  first.push_back(101);
  first.push_back(102);
  EXPECT_EQ(items(original), (std::vector<int>{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(items(first), (std::vector<int>{0, 1, 2, 3, 4, 5, 100, 101, 102}));
  EXPECT_EQ(items(second), (std::vector<int>{0, 1, 2, 3, 4, 5, 200, 201}));
}

TEST(ChunkedVector, AnOlderVersionMayBranchAtAChunkBorder) {
  const Small original = counting(4);
  Small first = original;
  Small second = original;
  first.push_back(1);
  second.push_back(2);
  EXPECT_EQ(first[4], 1);
  EXPECT_EQ(second[4], 2);
  EXPECT_EQ(original.size(), 4U);
}

TEST(ChunkedVector, AVersionFromTheMiddleCanGrowAgain) {
  Small vector;
  std::vector<Small> versions{vector};
  for (int i = 0; i < 11; ++i) {
    vector.push_back(i);
    versions.push_back(vector);
  }
  for (std::size_t n = 0; n < versions.size(); ++n) {
    Small branch = versions[n];
    branch.push_back(-1);
    EXPECT_EQ(branch.size(), n + 1);
    EXPECT_EQ(branch.back(), -1);
    for (std::size_t i = 0; i < n; ++i) EXPECT_EQ(branch[i], static_cast<int>(i));
  }
  EXPECT_EQ(items(vector), items(counting(11)));
}

TEST(ChunkedVector, SharesTheChunksOfItsCopies) {
  const Small original = counting(9);
  Small copy = original;
  EXPECT_TRUE(copy.shares_all_with(original));
  copy.push_back(9);
  EXPECT_FALSE(copy.shares_all_with(original));
  for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(copy.chunk(c).data(), original.chunk(c).data());
}

TEST(ChunkedVector, ReplacesOneElementOfACopy) {
  const Small original = counting(9);
  Small changed = original.with(5, 500);
  changed.push_back(9);
  EXPECT_EQ(items(original), items(counting(9)));
  EXPECT_EQ(items(changed), (std::vector<int>{0, 1, 2, 3, 4, 500, 6, 7, 8, 9}));
  EXPECT_EQ(changed.chunk(0).data(), original.chunk(0).data());
  EXPECT_NE(changed.chunk(1).data(), original.chunk(1).data());
}

TEST(ChunkedVector, TwoThreadsMayGrowTheirCopies) {
  const Small original = counting(6);
  Small grown[2] = {original, original};
  std::thread threads[2];
  for (int t = 0; t < 2; ++t) {
    threads[t] = std::thread([&grown, t] {
      for (int i = 0; i < 1000; ++i) grown[t].push_back(1000 * (t + 1) + i);
    });
  }
  for (auto& thread : threads) thread.join();
  for (int t = 0; t < 2; ++t) {
    ASSERT_EQ(grown[t].size(), 1006U);
    for (int i = 0; i < 1000; ++i) ASSERT_EQ(grown[t][static_cast<std::size_t>(6 + i)], 1000 * (t + 1) + i);
  }
}

}  // namespace
}  // namespace handloft::model
