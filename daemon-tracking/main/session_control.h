#pragma once
// How the rest of the world tells a running session what to do: end, or read its configuration anew. Waiting
// is for a request, never by polling. Thread-safe; signals come through SignalThread.

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>

namespace handloft::tracking {

/// Asked by a session that woke for a reload; takes it (SessionControl::take_reload). False: the session goes
/// on as it is, since what was read can't be used.
using AcceptReload = std::function<bool()>;

class SessionControl {
 public:
  /// Ends the session, for good.
  void stop();
  /// SIGHUP: reads configuration and calibration again.
  void reload();
  /// The sources have nothing more to say (PaceOptions::on_end).
  void note_end();

  bool stopping() const;
  /// True once for each time that a reload was asked for; several before this call count as one.
  bool take_reload();

  enum class Wake { stop, reload, end, timeout };
  /// Waits for the first of a stop, a reload, or the end of the sources; without a timeout for ever. A reload
  /// stays asked for until take_reload().
  Wake wait(std::optional<std::chrono::milliseconds> timeout = std::nullopt) const;
  /// Waits for a stop or a reload, whatever the sources do.
  Wake wait_for_request(std::optional<std::chrono::milliseconds> timeout = std::nullopt) const;
  /// Forgets the end of earlier sources.
  void begin();

 private:
  template <typename Asked>
  Wake wait_while(Asked asked, std::optional<std::chrono::milliseconds> timeout) const;

  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  bool stop_ = false;
  bool reload_ = false;
  bool ended_ = false;
};

}  // namespace handloft::tracking
