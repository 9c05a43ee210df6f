#pragma once
// What happened, in words (V7): refusals, warnings, exports. Newest first, fading by themselves, and never in
// the way of anything. Pure: time comes in.

#include <deque>
#include <string>
#include <vector>

#include "common/base/clock.h"

namespace handloft::client {

enum class NoticeKind { done, refused, warning };

struct Notice {
  NoticeKind kind = NoticeKind::done;
  std::string words;
  int times = 1;         ///< Told so often in a row.
  float opacity = 1.0F;  ///< 0..1
};

struct NoticeOptions {
  std::size_t most = 50;                          ///< Kept; older ones go.
  std::size_t most_shown = 4;                     ///< At once.
  std::size_t longest_bytes = 400;                ///< What is longer is cut.
  Duration shown = std::chrono::seconds(8);       ///< What went well; long enough to read three lines.
  Duration shown_bad = std::chrono::seconds(16);  ///< Refusals and warnings.
  Duration fading = std::chrono::milliseconds(600);
};

class Notices {
 public:
  explicit Notices(NoticeOptions options = {}) : options_(options) {}

  /// The same words again count up instead, and are shown anew. Empty words: nothing.
  void tell(NoticeKind kind, std::string words, TimePoint now);
  /// What is to be seen now, newest first.
  std::vector<Notice> visible(TimePoint now) const;
  /// All that is kept, newest first, for whoever looks back.
  std::vector<Notice> all() const;
  /// Put away by a click: `index` in visible().
  void dismiss(std::size_t index, TimePoint now);

 private:
  struct Told {
    Notice notice;
    TimePoint at;
    bool dismissed = false;
  };
  float opacity(const Told& told, TimePoint now) const;

  NoticeOptions options_;
  std::deque<Told> told_;  ///< Newest first.
};

}  // namespace handloft::client
