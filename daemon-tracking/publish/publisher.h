#pragma once
// Publishing to any number of subscribers (T14): each gets the newest state as fast as it reads, a slow one
// misses frames and never slows the daemon. Only a replay may be slowed, by subscribers that asked for every
// frame. Who subscribes in the middle, or after the end, gets the last frame at once, made whole.

#include <boost/asio/any_io_executor.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>

#include "common/base/clock.h"
#include "common/base/log.h"
#include "common/base/result.h"
#include "common/net/endpoint.h"
#include "proto/tracking.pb.h"

namespace handloft::tracking {

class Publisher {
 public:
  /// Listens at once; connections are served by the executor's threads. `clock` must outlive it.
  static Result<std::unique_ptr<Publisher>> listen(boost::asio::any_io_executor executor,
                                                   const net::Endpoint& endpoint, const Clock& clock,
                                                   Logger log);
  /// The same on a socket that listens already.
  static Result<std::unique_ptr<Publisher>> serve(boost::asio::any_io_executor executor,
                                                  net::Listener listener, const Clock& clock, Logger log);
  ~Publisher();
  Publisher(const Publisher&) = delete;
  Publisher& operator=(const Publisher&) = delete;

  const net::Endpoint& endpoint() const;

  /// Who is handed the glove's feedback of any subscriber (T9): valid, and at most `feedback_rate_hz` a
  /// subscriber but for a short burst; what comes faster is dropped. On one of the executor's threads, one
  /// call at a time; it must be quick. Empty, as at first: feedback is accepted and forgotten.
  void on_glove_feedback(std::function<void(const v1::GloveFeedback&)> callback);
  static constexpr double feedback_rate_hz = 50.0;  ///< A hand feels no pulses that follow faster.
  static constexpr double feedback_burst = 10.0;
  /// Subscribers' feedback that came too fast.
  std::uint64_t feedback_dropped() const;

  /// Stamps `frame` with the publish time and sends it to everyone. One thread at a time; never blocks.
  void publish(v1::TrackingFrame& frame);

  /// For replays: waits while a subscriber that asked for every frame has more than a few of them unread, at
  /// most `timeout`. A subscriber that takes longer is closed, so that it can't hold up the rest. Returns
  /// early, and closes nobody, once `give_up` (asked ten times a second; may be empty) says so.
  void wait_for_readers(std::chrono::milliseconds timeout, const std::function<bool()>& give_up = {});
  /// Waits until everything was sent, or for `timeout`. True: all was.
  bool drain(std::chrono::milliseconds timeout);

  /// Waits for `count` subscribers; false after `timeout`.
  bool wait_for_subscribers(std::size_t count, std::chrono::milliseconds timeout);
  std::size_t subscriber_count() const;
  /// Frames that slow subscribers did not get, over all of them.
  std::uint64_t frames_missed() const;

  /// First phase of the shutdown: nobody is accepted any more, connections end.
  void stop();

 private:
  struct Implementation;
  explicit Publisher(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace handloft::tracking
