// What became of what was asked of the model server (V6): told once, in order, within bounds.

#include "client-hmd/mirror/pending_requests.h"

#include <gtest/gtest.h>

namespace handloft::client {
namespace {

TEST(PendingRequests, AreAnsweredOnceInTheOrderOfTheirAnswers) {
  PendingRequests requests;
  const std::uint64_t fit = requests.next();
  const std::uint64_t undo = requests.next();
  ASSERT_TRUE(requests.add(fit, "fit").ok());
  ASSERT_TRUE(requests.add(undo, "undo").ok());
  EXPECT_TRUE(requests.answer(undo, "nothing to undo", {}));
  EXPECT_TRUE(requests.answer(fit, "", {"degree lowered"}));
  EXPECT_FALSE(requests.answer(fit, "", {})) << "twice";
  EXPECT_FALSE(requests.answer(99, "", {})) << "never asked";
  const auto answers = requests.take();
  ASSERT_EQ(answers.size(), 2U);
  EXPECT_EQ(answers[0].what, "undo");
  EXPECT_EQ(answers[0].refusal, "nothing to undo");
  EXPECT_EQ(answers[1].notes, std::vector<std::string>{"degree lowered"});
  EXPECT_TRUE(requests.take().empty());
}

TEST(PendingRequests, ABrokenConnectionRefusesAllThatAreUnderWay) {
  PendingRequests requests;
  ASSERT_TRUE(requests.add(requests.next(), "fit").ok());
  requests.abandon("gone");
  const auto answers = requests.take();
  ASSERT_EQ(answers.size(), 1U);
  EXPECT_EQ(answers[0].refusal, "gone");
}

TEST(PendingRequests, AServerThatNeverAnswersCostsNoMemory) {
  PendingRequests requests;
  std::size_t taken = 0;
  for (int i = 0; i < 10'000; ++i) taken += requests.add(requests.next(), "fit").ok() ? 1 : 0;
  EXPECT_EQ(taken, PendingRequests::most);
  for (int round = 0; round < 3; ++round) {
    requests.abandon("gone");
    for (std::size_t i = 0; i < PendingRequests::most; ++i)
      EXPECT_TRUE(requests.add(requests.next(), "fit").ok());
  }
  requests.abandon("gone");
  EXPECT_EQ(requests.take().size(), PendingRequests::most);
}

}  // namespace
}  // namespace handloft::client
