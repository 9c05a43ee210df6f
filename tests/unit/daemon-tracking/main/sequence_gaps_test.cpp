#include "daemon-tracking/main/sequence_gaps.h"

#include <gtest/gtest.h>

namespace handloft::tracking {
namespace {

TEST(SequenceGaps, CountsWhatIsMissingBetweenFrames) {
  SequenceGaps gaps;
  EXPECT_EQ(gaps.note(17), 0u) << "nobody knows what was before the first";
  EXPECT_EQ(gaps.note(18), 0u);
  EXPECT_EQ(gaps.note(22), 3u);
  EXPECT_EQ(gaps.note(22), 0u);
  EXPECT_EQ(gaps.note(0), 0u) << "a camera that was plugged in again";
  EXPECT_EQ(gaps.note(2), 1u);
  EXPECT_EQ(gaps.missing(), 4u);
}

}  // namespace
}  // namespace handloft::tracking
