#include "daemon-tracking/source/paced_source.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

namespace handloft::tracking {
namespace {

/// Longest sleep before the clock is read again: an injected clock may jump.
constexpr Duration longest_sleep = std::chrono::milliseconds(5);

}  // namespace

struct PacedSource::State {
  State(std::string source_name, std::unique_ptr<SampleStream> source_stream, const Clock& source_clock,
        PaceOptions source_options)
      : name(std::move(source_name)),
        stream(std::move(source_stream)),
        clock(source_clock),
        options(source_options) {
    options.ahead = std::max<std::size_t>(1, options.ahead);
  }

  void prepare() {
    for (;;) {
      std::optional<Sample> sample = stream->next();
      std::unique_lock lock(mutex);
      if (!sample) {
        ended = true;
        changed.notify_all();
        return;
      }
      shift_times(*sample, options.shift);
      changed.wait(lock, [&] { return stopping || ready.size() < options.ahead; });
      if (stopping) return;
      ready.push_back(std::move(*sample));
      changed.notify_all();
    }
  }

  void deliver() {
    for (;;) {
      std::unique_lock lock(mutex);
      changed.wait(lock, [&] { return stopping || ended || !ready.empty(); });
      if (stopping || ready.empty()) break;
      Sample sample = std::move(ready.front());
      ready.pop_front();
      changed.notify_all();
      if (options.pace == Pace::real_time) {
        const TimePoint due = delivery_time(sample);
        for (TimePoint now = clock.now(); now < due && !stopping; now = clock.now()) {
          changed.wait_for(lock, std::min(due - now, longest_sleep), [&] { return stopping; });
        }
      }
      if (stopping) break;
      lock.unlock();
      sink(std::move(sample));
    }
    finished = true;
  }

  std::string name;
  std::unique_ptr<SampleStream> stream;
  const Clock& clock;
  PaceOptions options;
  SampleSink sink;
  std::mutex mutex;
  std::condition_variable changed;
  std::deque<Sample> ready;
  bool stopping = false, ended = false, started = false;
  std::atomic<bool> finished{false};
  std::thread preparer, deliverer;
};

PacedSource::PacedSource(std::string name, std::unique_ptr<SampleStream> stream, const Clock& clock,
                         PaceOptions options)
    : state_(std::make_unique<State>(std::move(name), std::move(stream), clock, options)) {}

PacedSource::~PacedSource() {
  stop();
}

const std::string& PacedSource::name() const {
  return state_->name;
}

Status PacedSource::start(SampleSink sink) {
  const std::scoped_lock lock(state_->mutex);
  if (state_->started) return make_error(ErrorCode::failed_precondition, "already started", state_->name);
  state_->started = true;
  state_->sink = std::move(sink);
  State* state = state_.get();
  state_->preparer = std::thread([state] { state->prepare(); });
  state_->deliverer = std::thread([state] { state->deliver(); });
  return {};
}

void PacedSource::stop() {
  {
    const std::scoped_lock lock(state_->mutex);
    state_->stopping = true;
  }
  state_->changed.notify_all();
  if (state_->preparer.joinable()) state_->preparer.join();
  if (state_->deliverer.joinable()) state_->deliverer.join();
}

bool PacedSource::finished() const {
  return state_->finished;
}

}  // namespace handloft::tracking
