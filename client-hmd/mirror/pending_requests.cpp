#include "client-hmd/mirror/pending_requests.h"

#include <utility>

namespace handloft::client {

std::uint64_t PendingRequests::next() {
  const std::lock_guard lock(mutex_);
  return ++last_;
}

Status PendingRequests::add(std::uint64_t number, std::string what) {
  const std::lock_guard lock(mutex_);
  if (under_way_.size() >= most) {
    return make_error(ErrorCode::resource_exhausted, "the model server has not answered for too long");
  }
  under_way_.emplace(number, std::move(what));
  return {};
}

void PendingRequests::forget(std::uint64_t number) {
  const std::lock_guard lock(mutex_);
  under_way_.erase(number);
}

bool PendingRequests::answer(std::uint64_t number, std::string refusal, std::vector<std::string> notes) {
  const std::lock_guard lock(mutex_);
  const auto node = under_way_.extract(number);
  if (node.empty()) return false;
  keep({node.mapped(), std::move(refusal), std::move(notes)});
  return true;
}

void PendingRequests::abandon(const std::string& refusal) {
  const std::lock_guard lock(mutex_);
  for (auto& [number, what] : under_way_) keep({std::move(what), refusal, {}});
  under_way_.clear();
}

std::vector<Acknowledgement> PendingRequests::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(answered_, {});
}

void PendingRequests::keep(Acknowledgement acknowledgement) {
  if (answered_.size() >= most) answered_.erase(answered_.begin());
  answered_.push_back(std::move(acknowledgement));
}

}  // namespace handloft::client
