#include "server-model/model/history.h"

#include <algorithm>

namespace handloft::model {

History::History(Document initial, std::size_t max_steps)
    : base_(std::move(initial)), max_steps_(std::max<std::size_t>(1, max_steps)) {}

const Document& History::current() const {
  return position_ == 0 ? base_ : steps_[position_ - 1].after;
}

void History::push(Step step) {
  steps_.erase(steps_.begin() + static_cast<std::ptrdiff_t>(position_), steps_.end());
  steps_.push_back(std::move(step));
  ++position_;
  if (steps_.size() > max_steps_) {
    base_ = std::move(steps_.front().after);
    steps_.pop_front();
    --position_;
  }
}

Result<std::string> History::undo() {
  if (position_ == 0) return make_error(ErrorCode::failed_precondition, "there is nothing to undo", "undo");
  --position_;
  return steps_[position_].words;
}

Result<std::string> History::redo() {
  if (position_ == steps_.size()) {
    return make_error(ErrorCode::failed_precondition, "there is nothing to redo", "redo");
  }
  ++position_;
  return steps_[position_ - 1].words;
}

std::string History::next_undo() const {
  return position_ == 0 ? std::string() : steps_[position_ - 1].words;
}

std::string History::next_redo() const {
  return position_ == steps_.size() ? std::string() : steps_[position_].words;
}

}  // namespace handloft::model
