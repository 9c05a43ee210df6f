#include "server-model/session/actor_threads.h"

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <future>
#include <thread>
#include <utility>
#include <vector>

namespace handloft::session {
namespace {

/// Not an asio::thread_pool: of one thread it lets work that came later from outside pass work from within.
class ThreadQueue final : public WorkQueue {
 public:
  explicit ThreadQueue(std::size_t threads) : work_(boost::asio::make_work_guard(context_)) {
    for (std::size_t i = 0; i < threads; ++i) threads_.emplace_back([this] { context_.run(); });
  }
  ~ThreadQueue() override { end(); }
  ThreadQueue(const ThreadQueue&) = delete;
  ThreadQueue& operator=(const ThreadQueue&) = delete;

  void post(std::function<void()> work) override { boost::asio::post(context_, std::move(work)); }
  void run_and_wait(const std::function<void()>& work) override {
    std::promise<void> done;
    auto future = done.get_future();
    post([&] {
      work();
      done.set_value();
    });
    future.get();
  }
  void stop() override { end(); }

 private:
  void end() {
    context_.stop();
    for (std::thread& thread : threads_) {
      if (thread.joinable()) thread.join();
    }
  }

  boost::asio::io_context context_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_;
  std::vector<std::thread> threads_;
};

}  // namespace

std::shared_ptr<WorkQueue> start_queue() {
  return std::make_shared<ThreadQueue>(1);
}

ActorThreads start_threads(std::size_t pool_threads) {
  return {std::make_shared<ThreadQueue>(1), std::make_shared<ThreadQueue>(pool_threads)};
}

}  // namespace handloft::session
