#include "server-model/model/history.h"

#include <algorithm>

namespace handloft::model {

History::History(Document initial, std::size_t max_steps)
    : base_(std::move(initial)), max_steps_(std::max<std::size_t>(1, max_steps)) {}

History::History(Document base, std::vector<StepPtr> steps, std::size_t position, std::size_t max_steps)
    : base_(std::move(base)),
      steps_(steps.begin(), steps.end()),
      position_(position),
      max_steps_(std::max<std::size_t>(1, max_steps)) {
  while (steps_.size() > max_steps_ && position_ > 0) forget_oldest();
}

void History::forget_oldest() {
  base_ = steps_.front()->after;
  steps_.pop_front();
  --position_;
}

const Document& History::current() const {
  return position_ == 0 ? base_ : steps_[position_ - 1]->after;
}

void History::push(Step step) {
  steps_.erase(steps_.begin() + static_cast<std::ptrdiff_t>(position_), steps_.end());
  steps_.push_back(std::make_shared<const Step>(std::move(step)));
  ++position_;
  if (steps_.size() > max_steps_) forget_oldest();
}

Result<std::string> History::undo() {
  if (position_ == 0) return make_error(ErrorCode::failed_precondition, "there is nothing to undo", "undo");
  --position_;
  return steps_[position_]->words;
}

Result<std::string> History::redo() {
  if (position_ == steps_.size()) {
    return make_error(ErrorCode::failed_precondition, "there is nothing to redo", "redo");
  }
  ++position_;
  return steps_[position_ - 1]->words;
}

std::string History::next_undo() const {
  return position_ == 0 ? std::string() : steps_[position_ - 1]->words;
}

std::string History::next_redo() const {
  return position_ == steps_.size() ? std::string() : steps_[position_]->words;
}

}  // namespace handloft::model
