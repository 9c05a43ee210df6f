// The difference of two versions in words is asked for, one question at a time (U6).

#include "client-hmd/mirror/difference_asker.h"

#include <gtest/gtest.h>

namespace handloft::client {
namespace {

v1::Answer answer_to(const v1::Envelope& question, std::initializer_list<const char*> sentences) {
  v1::Answer answer;
  answer.set_request(question.ask().request());
  for (const char* sentence : sentences)
    answer.mutable_result()->mutable_difference()->add_sentences(sentence);
  return answer;
}

TEST(DifferenceAsker, AsksAndKeepsTheAnswer_U6) {
  DifferenceAsker asker;
  EXPECT_FALSE(asker.newest().has_value());
  const v1::Envelope question = asker.question("first", "second");
  EXPECT_EQ(question.ask().query().difference().from(), "first");
  EXPECT_EQ(question.ask().query().difference().to(), "second");
  EXPECT_TRUE(asker.newest()->asking);
  ASSERT_TRUE(asker.take(answer_to(question, {"Ann moved seat by 12 mm.", "Bo fitted back\n again."})));
  const VersionDifference expected{
      "first", "second", false, {"Ann moved seat by 12 mm.", "Bo fitted back  again."}, ""};
  EXPECT_EQ(*asker.newest(), expected);
  EXPECT_FALSE(asker.take(answer_to(question, {"again"}))) << "it was answered";
}

TEST(DifferenceAsker, TakesOnlyWhatAnswersTheNewestQuestion) {
  DifferenceAsker asker;
  const v1::Envelope first = asker.question("a", ""), second = asker.question("b", "");
  EXPECT_FALSE(asker.take(answer_to(first, {"of a"})));
  EXPECT_TRUE(asker.newest()->asking);
  EXPECT_TRUE(asker.take(answer_to(second, {"of b"})));
  EXPECT_EQ(asker.newest()->sentences, std::vector<std::string>{"of b"});
}

TEST(DifferenceAsker, SaysWhyThereIsNone) {
  DifferenceAsker asker;
  v1::Answer refused;
  refused.set_request(asker.question("gone", "").ask().request());
  refused.mutable_failure()->set_message("there is no version \"gone\"");
  ASSERT_TRUE(asker.take(refused));
  EXPECT_EQ(asker.newest()->refusal, "there is no version \"gone\"");
  asker.question("a", "");
  EXPECT_TRUE(asker.abandon("the connection broke"));
  EXPECT_EQ(asker.newest()->refusal, "the connection broke");
  EXPECT_FALSE(asker.newest()->asking);
  EXPECT_FALSE(asker.abandon("again"));
}

TEST(DifferenceAsker, BoundsWhatAServerSays) {
  DifferenceAsker asker;
  v1::Answer much;
  much.set_request(asker.question("a", "").ask().request());
  for (int i = 0; i < 5000; ++i)
    much.mutable_result()->mutable_difference()->add_sentences(std::string(9, 'x') + "\xC3\xA4");
  ASSERT_TRUE(asker.take(much, {.max_sentences = 3, .max_sentence_bytes = 10}));
  ASSERT_EQ(asker.newest()->sentences.size(), 4U);
  EXPECT_EQ(asker.newest()->sentences[0], std::string(9, 'x')) << "half a letter is none";
  EXPECT_EQ(asker.newest()->sentences[3], "and 4997 more");
}

}  // namespace
}  // namespace handloft::client
