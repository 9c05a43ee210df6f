#pragma once
// The linear history of a document: every step is a whole document value, so undo and redo restore
// bit-identical state (A28) and cost nothing; memory is bounded by sharing and by Limits::max_history_steps.
// Client ids are kept so that undo per user can be built on it.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "server-model/model/document.h"

namespace handloft::model {

class History {
 public:
  struct Step {
    Document after;
    std::string words;
    std::uint64_t client_id = 0;
    std::uint64_t client_op_id = 0;
  };

  using StepPtr = std::shared_ptr<const Step>;

  explicit History(Document initial = {}, std::size_t max_steps = Limits{}.max_history_steps);
  /// As it was: `position` of the steps after `base` are applied. Of more than max_steps the oldest are
  /// forgotten. Precondition: position <= steps.size().
  History(Document base, std::vector<StepPtr> steps, std::size_t position,
          std::size_t max_steps = Limits{}.max_history_steps);

  const Document& current() const;
  /// Forgets what could be redone. The oldest step is forgotten beyond max_steps.
  void push(Step step);
  /// failed_precondition when there is nothing to undo or redo.
  Result<std::string> undo();  ///< The words of the step undone.
  Result<std::string> redo();

  std::size_t undo_steps() const { return position_; }
  std::size_t redo_steps() const { return steps_.size() - position_; }
  std::string next_undo() const;  ///< In words; empty: nothing.
  std::string next_redo() const;
  /// Steps 0..undo_steps() are applied, oldest first; those behind can be redone.
  const std::deque<StepPtr>& steps() const { return steps_; }
  const Document& base() const { return base_; }  ///< Before the first step.

 private:
  void forget_oldest();

  Document base_;
  std::deque<StepPtr> steps_;  ///< Shared, so that a copy of the history costs pointers.
  std::size_t position_ = 0;   ///< Steps applied.
  std::size_t max_steps_;
};

}  // namespace handloft::model
