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

// How far ahead of the clock frames are left out follows how late the prepared ones were: grows by half of a
// frame's lateness, shrinks by an eighth with each that is in time, and never exceeds some frames.
constexpr int lead_growth_divisor = 2;
constexpr int lead_decay_divisor = 8;
constexpr int longest_lead_factor = 8;

}  // namespace

struct PacedSource::State {
  State(std::string source_name, std::unique_ptr<SampleStream> source_stream, const Clock& source_clock,
        PaceOptions source_options)
      : name(std::move(source_name)),
        stream(std::move(source_stream)),
        clock(source_clock),
        options(source_options) {
    options.ahead = std::max<std::size_t>(1, options.ahead);
    begun = options.pace != Pace::real_time || options.start == TimeLineStart::shifted;
  }

  bool real_time() const { return options.pace == Pace::real_time; }
  bool may_drop() const { return real_time() && options.drop_frames_later_than.has_value(); }

  void prepare() {
    for (;;) {
      if (may_drop()) leave_out_what_is_too_late();
      std::optional<Sample> sample = stream->next();
      std::unique_lock lock(mutex);
      if (!sample) {
        ended = true;
        begin();
        changed.notify_all();
        return;
      }
      if (begun) shift_times(*sample, options.shift);
      changed.wait(lock, [&] { return stopping || ready.size() < options.ahead; });
      if (stopping) return;
      ready.push_back(std::move(*sample));
      if (ready.size() == options.ahead) begin();
      changed.notify_all();
    }
  }

  // The preparing thread, without the mutex.
  void leave_out_what_is_too_late() {
    TimePoint before;
    {
      const std::scoped_lock lock(mutex);
      if (!begun) return;
      before = clock.now() - options.shift + lead;
    }
    stream->skip_frames_before(before);
  }

  // With the mutex held: the first samples are prepared, the time line may begin.
  void begin() {
    if (begun) return;
    begun = true;
    if (ready.empty()) return;
    options.shift = clock.now() - delivery_time(ready.front());
    for (Sample& sample : ready) shift_times(sample, options.shift);
  }

  // With the mutex held.
  bool too_late(const Sample& sample) {
    if (!may_drop() || !std::holds_alternative<CameraFrame>(sample)) return false;
    const Duration bound = *options.drop_frames_later_than;
    const Duration late = clock.now() - delivery_time(sample);
    if (late <= bound) {
      lead -= lead / lead_decay_divisor;
      return false;
    }
    lead = std::min(lead + late / lead_growth_divisor, longest_lead_factor * bound);
    ++dropped;
    return true;
  }

  void deliver() {
    for (;;) {
      std::unique_lock lock(mutex);
      changed.wait(lock, [&] { return stopping || (begun && (ended || !ready.empty())); });
      if (stopping || ready.empty()) break;
      Sample sample = std::move(ready.front());
      ready.pop_front();
      changed.notify_all();
      if (real_time()) {
        const TimePoint due = delivery_time(sample);
        for (TimePoint now = clock.now(); now < due && !stopping; now = clock.now()) {
          changed.wait_for(lock, std::min(due - now, longest_sleep), [&] { return stopping; });
        }
      }
      if (stopping) break;
      if (too_late(sample)) continue;
      lock.unlock();
      sink(std::move(sample));
    }
    finished = true;
    const std::unique_lock lock(mutex);
    if (!stopping && options.on_end) options.on_end();
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
  bool begun = false;  // options.shift is final.
  Duration lead{};     // Frames due before now + lead are not worth preparing.
  std::uint64_t dropped = 0;
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

std::uint64_t PacedSource::frames_dropped() const {
  const std::scoped_lock lock(state_->mutex);
  return state_->dropped;
}

}  // namespace handloft::tracking
