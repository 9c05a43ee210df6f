#include "client-hmd/hud/notices.h"

#include <algorithm>

#include "client-hmd/hud/words.h"

namespace handloft::client {

void Notices::tell(NoticeKind kind, std::string words, TimePoint now) {
  if (words.empty()) return;
  words = shortened(words, options_.longest_bytes);
  if (!told_.empty() && told_.front().notice.words == words && told_.front().notice.kind == kind) {
    ++told_.front().notice.times;
    told_.front().at = now;
    told_.front().dismissed = false;
    return;
  }
  told_.push_front({{kind, std::move(words), 1, 1.0F}, now, false});
  if (told_.size() > options_.most) told_.pop_back();
}

float Notices::opacity(const Told& told, TimePoint now) const {
  if (told.dismissed) return 0.0F;
  const Duration shown = told.notice.kind == NoticeKind::done ? options_.shown : options_.shown_bad;
  const Duration left = told.at + shown + options_.fading - now;
  if (options_.fading <= Duration::zero()) return left > Duration::zero() ? 1.0F : 0.0F;
  return std::clamp(static_cast<float>(to_seconds(left) / to_seconds(options_.fading)), 0.0F, 1.0F);
}

std::vector<Notice> Notices::visible(TimePoint now) const {
  std::vector<Notice> seen;
  for (const Told& told : told_) {
    if (seen.size() >= options_.most_shown) break;
    const float share = opacity(told, now);
    if (share <= 0.0F) continue;
    seen.push_back(told.notice);
    seen.back().opacity = share;
  }
  return seen;
}

std::vector<Notice> Notices::all() const {
  std::vector<Notice> notices;
  for (const Told& told : told_) notices.push_back(told.notice);
  return notices;
}

void Notices::dismiss(std::size_t index, TimePoint now) {
  std::size_t seen = 0;
  for (Told& told : told_) {
    if (opacity(told, now) <= 0.0F) continue;
    if (seen++ != index) continue;
    told.dismissed = true;
    return;
  }
}

}  // namespace handloft::client
