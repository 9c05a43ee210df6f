#pragma once
// Asio on a thread of its own, ended and joined with the object.

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <future>
#include <optional>
#include <thread>

namespace handloft::net {

class IoThread {
 public:
  IoThread()
      : work_(context_.get_executor()), thread_([this, promise = std::move(ended_promise_)]() mutable {
          context_.run();
          promise.set_value();
        }) {}
  ~IoThread() { finish(); }
  IoThread(const IoThread&) = delete;
  IoThread& operator=(const IoThread&) = delete;

  boost::asio::io_context& context() { return context_; }

  /// Lets what is under way end, for a moment, then ends.
  void finish() {
    if (!thread_.joinable()) return;
    work_.reset();
    ended_.wait_for(longest_farewell);
    context_.stop();
    thread_.join();
  }

 private:
  static constexpr auto longest_farewell = std::chrono::milliseconds(1500);
  boost::asio::io_context context_{1};
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_;
  std::promise<void> ended_promise_;
  std::future<void> ended_ = ended_promise_.get_future();
  std::thread thread_;
};

}  // namespace handloft::net
