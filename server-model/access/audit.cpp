#include "server-model/access/audit.h"

#include <utility>

namespace handloft::access {

namespace {
constexpr std::int64_t seconds_a_minute = 60;
/// Users and addresses that are told apart in a minute; beyond, nothing of new ones is written.
constexpr std::size_t most_keys = 4096;
}  // namespace

std::string_view to_string(AuditKind kind) {
  switch (kind) {
    case AuditKind::join:
      return "join";
    case AuditKind::leave:
      return "leave";
    case AuditKind::refusal:
      return "refusal";
    case AuditKind::role:
      return "role";
    case AuditKind::invite:
      return "invite";
    case AuditKind::pairing:
      return "pairing";
    case AuditKind::revocation:
      return "revocation";
    case AuditKind::suppressed:
      return "suppressed";
  }
  return "";
}

bool AuditThrottle::admits(const std::string& key, Who who, std::int64_t now_s) {
  const std::int64_t minute = now_s / seconds_a_minute;
  if (minute != minute_) {
    minute_ = minute;
    counts_.clear();
    strangers_ = 0;
  }
  const auto found = counts_.find(key);
  const bool full =
      found != counts_.end() ? found->second >= limits_.per_peer_per_minute : counts_.size() >= most_keys;
  if (full || (who == Who::stranger && strangers_ >= limits_.strangers_per_minute)) {
    ++left_out_;
    return false;
  }
  ++counts_[key];
  if (who == Who::stranger) ++strangers_;
  return true;
}

std::uint64_t AuditThrottle::take_left_out() {
  return std::exchange(left_out_, 0);
}

}  // namespace handloft::access
