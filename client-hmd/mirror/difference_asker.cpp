#include "client-hmd/mirror/difference_asker.h"

#include <fmt/format.h>

#include "common/base/plain_text.h"

namespace handloft::client {
v1::Envelope DifferenceAsker::question(const std::string& from, const std::string& to) {
  asked_ = next_request_++;
  newest_ = VersionDifference{from, to, true, {}, {}};
  v1::Envelope envelope;
  envelope.mutable_ask()->set_request(asked_);
  v1::DifferenceQuery& query = *envelope.mutable_ask()->mutable_query()->mutable_difference();
  query.set_from(from);
  query.set_to(to);
  return envelope;
}

bool DifferenceAsker::take(const v1::Answer& answer, const DifferenceLimits& limits) {
  if (asked_ == 0 || answer.request() != asked_) return false;
  asked_ = 0;
  newest_->asking = false;
  if (!answer.has_result() || !answer.result().has_difference()) {
    const std::string& why = answer.failure().message();
    newest_->refusal =
        why.empty() ? "the server gives no answer" : plain_text(why, limits.max_sentence_bytes);
    return true;
  }
  const auto& sentences = answer.result().difference().sentences();
  for (const std::string& sentence : sentences) {
    if (static_cast<int>(newest_->sentences.size()) == limits.max_sentences) {
      newest_->sentences.push_back(fmt::format("and {} more", sentences.size() - limits.max_sentences));
      break;
    }
    newest_->sentences.push_back(plain_text(sentence, limits.max_sentence_bytes));
  }
  return true;
}

bool DifferenceAsker::abandon(const std::string& why) {
  if (asked_ == 0) return false;
  asked_ = 0;
  newest_->asking = false;
  newest_->refusal = why;
  return true;
}

}  // namespace handloft::client
