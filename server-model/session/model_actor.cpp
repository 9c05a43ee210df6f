#include "server-model/session/model_actor.h"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <future>
#include <string>
#include <utility>
#include <vector>

#include "server-model/model/canonical.h"
#include "server-model/model/reference_distance.h"
#include "server-model/session/export.h"
#include "server-model/session/palette_export.h"
#include "server-model/session/presence.h"

namespace handloft::session {
namespace {

/// While frames wait (a replay), only every so many of them make a scene; a live hand never has frames
/// waiting.
constexpr int max_frames_without_scene = 4;

/// What a hand's presence says while it lies on the palette's "Export" (palette_commands.cpp).
constexpr std::string_view export_words = "export";

bool reads_files(const v1::Operation& operation) {
  if (operation.has_import_reference()) return !operation.import_reference().has_resolved();
  if (operation.has_import_model()) return true;  // Also one that brings a model: it is refused there.
  return operation.has_import_strokes() &&
         (!operation.import_strokes().path().empty() || operation.import_strokes().resolved().empty());
}

std::vector<stream::IconMark> scene_marks(const std::vector<interaction::IconMark>& marks) {
  using From = interaction::IconMark::Kind;
  using To = stream::IconMark::Kind;
  std::vector<stream::IconMark> result;
  result.reserve(marks.size());
  for (const interaction::IconMark& mark : marks) {
    result.push_back({mark.name.entity, mark.name.icon, mark.kind == From::held ? To::held : To::target});
  }
  return result;
}

}  // namespace

ModelActor::ModelActor(model::Model initial, ActorOptions options, ActorEvents events, const Clock& clock,
                       Logger log)
    : events_(std::move(events)),
      options_(std::move(options)),
      clock_(clock),
      log_(std::move(log)),
      model_(std::move(initial)),
      interaction_(model_, options_.interaction),
      meshes_([this](std::function<void()> job) { in_pool(std::move(job)); },
              [this] { post([this] { publish_scene(); }); }, options_.meshes),
      builder_(options_.epoch, meshes_),
      pool_(options_.pool_threads),
      work_(boost::asio::make_work_guard(context_)) {
  publish_scene();
  thread_ = std::thread([this] { context_.run(); });
}

ModelActor::~ModelActor() {
  stop();
}

void ModelActor::stop() {
  stopped_ = true;
  { const std::lock_guard lock(frames_mutex_); }
  frames_taken_.notify_all();
  context_.stop();
  if (thread_.joinable()) thread_.join();
  pool_.stop();
  pool_.join();
}

void ModelActor::post(std::function<void()> work) {
  ++pending_work_;
  boost::asio::post(context_, [this, work = std::move(work)] {
    work();
    --pending_work_;
  });
}

void ModelActor::push_frame(v1::TrackingFrame frame) {
  {
    std::unique_lock lock(frames_mutex_);
    frames_taken_.wait(lock, [&] { return pending_frames_ < options_.max_pending_frames || stopped_; });
    if (stopped_) return;
    ++pending_frames_;
  }
  post([this, frame = std::move(frame)] { on_frame(frame); });
}

void ModelActor::set_feel(std::function<void(const v1::GloveFeedback&)> feel) {
  post([this, feel = std::move(feel)]() mutable { feel_ = std::move(feel); });
}

void ModelActor::tracking_lost() {
  post([this] {
    report(interaction_.finish());
    publish_scene();
  });
}

void ModelActor::count_sequence(const v1::TrackingFrame& frame) {
  ++tracking_.frames;
  if (last_sequence_ && frame.sequence() > *last_sequence_)
    tracking_.gaps += frame.sequence() - *last_sequence_ - 1;
  if (last_sequence_ && frame.sequence() <= *last_sequence_) ++tracking_.resets;
  last_sequence_ = frame.sequence();
}

void ModelActor::on_frame(const v1::TrackingFrame& frame) {
  std::size_t waiting = 0;
  {
    const std::lock_guard lock(frames_mutex_);
    waiting = --pending_frames_;
  }
  frames_taken_.notify_one();

  count_sequence(frame);
  const std::uint64_t ignored = interaction_.statistics().frames_ignored;
  const interaction::FrameOutcome outcome = interaction_.on_frame(frame);
  if (outcome.scene_changed) {
    capture_time_ns_ = frame.capture_time_ns();
    ++frames_without_scene_;
  }
  if (frames_without_scene_ > 0 && (waiting == 0 || frames_without_scene_ >= max_frames_without_scene))
    publish_scene();
  report(outcome);
  for (std::size_t i = 0; i < outcome.exports.size(); ++i) export_for_hand();
  if (feel_) {
    for (const interaction::Pulse pulse : outcome.pulses) feel_(glove_feedback(pulse));
  }
  if (interaction_.statistics().frames_ignored == ignored) publish_presence(frame);
  if (frame.end_of_recording() && events_.on_end_of_recording) events_.on_end_of_recording();
}

void ModelActor::report(const interaction::FrameOutcome& outcome) {
  for (const model::Submitted& submitted : outcome.submitted) {
    log_.debug("hand: {} ({})", submitted.words, submitted.sequence);
    for (const std::string& note : submitted.notes) log_.info("{}", note);
    for (const std::string& gesture : submitted.cancelled_gestures) log_.warning("{}", gesture);
  }
  for (const std::string& problem : outcome.problems) {
    if (const auto kept_back = problem_rate_.allow(clock_.now())) {
      log_.warning("{}{}", problem, *kept_back > 0 ? " (and " + std::to_string(*kept_back) + " more)" : "");
    }
  }
}

void ModelActor::publish_presence(const v1::TrackingFrame& frame) {
  if (!events_.on_presence) return;
  const int hands = std::min(frame.hands_size(), static_cast<int>(interaction::Interaction::max_hands));
  for (int i = 0; i < std::max(1, hands); ++i) {
    v1::Presence presence = hand_presence(frame, i, interaction_);
    // What the hand does now is more important than what became of its export.
    if (!notice_.empty() && (presence.tool().empty() || presence.tool() == export_words)) {
      presence.set_tool(notice_);
      presence = clean_presence(std::move(presence));
    }
    events_.on_presence(presence);
  }
  if (!notice_.empty() && clock_.now() > notice_until_) notice_.clear();
}

void ModelActor::export_for_hand() {
  in_pool([this, document = model_.document()] {
    auto exported = model::export_from_palette(document, options_.export_folder, options_.cad);
    post([this, exported = std::move(exported)] {
      if (!exported) {
        log_.warning("export refused: {}", exported.error().describe());
        notify("export refused: " + exported.error().message);
        return;
      }
      log_.info("exported \"{}\"", exported->path.string());
      for (const std::string& note : exported->notes) log_.info("{}", note);
      notify("exported " + exported->path.filename().string());
    });
  });
}

void ModelActor::notify(std::string words) {
  notice_ = std::move(words);
  notice_until_ = clock_.now() + options_.notice_for;
}

void ModelActor::publish_scene() {
  frames_without_scene_ = 0;
  stream::ScenePtr scene = builder_.build(model_, interaction_.active_shape(), capture_time_ns_,
                                          interaction_.targets(), scene_marks(interaction_.icon_marks()));
  {
    const std::lock_guard lock(scene_mutex_);
    scene_.swap(scene);
  }
  if (events_.on_scene) events_.on_scene();
}

stream::ScenePtr ModelActor::scene() const {
  const std::lock_guard lock(scene_mutex_);
  return scene_;
}

void ModelActor::submit(v1::Operation operation, model::FileAccess files,
                        std::function<void(Result<Outcome>)> done) {
  const auto apply = [this](const v1::Operation& resolved,
                            const std::function<void(Result<Outcome>)>& answer) {
    auto submitted = model_.submit(resolved);
    if (!submitted) {
      answer(submitted.error());
      return;
    }
    if (submitted->sequence != 0) publish_scene();
    Outcome outcome;
    outcome.sequence = submitted->sequence;
    outcome.entities = submitted->changes.all();
    outcome.notes = submitted->notes;
    answer(std::move(outcome));
  };
  if (operation.has_export_()) {
    post([this, operation = std::move(operation), files = std::move(files), done = std::move(done)] {
      in_pool([document = model_.document(), operation, files, done] {
        auto exported = model::export_document(document, operation.export_(), files);
        if (!exported) {
          done(exported.error());
          return;
        }
        Outcome outcome;
        outcome.entities = std::move(exported->entities);
        outcome.notes = std::move(exported->notes);
        done(std::move(outcome));
      });
    });
  } else if (reads_files(operation)) {
    in_pool(
        [this, apply, operation = std::move(operation), files = std::move(files), done = std::move(done)] {
          auto resolved = model::resolve_operation(operation, files, model_.limits());
          if (!resolved) {
            done(resolved.error());
            return;
          }
          post([apply, resolved = *std::move(resolved), done] { apply(resolved, done); });
        });
  } else {
    post([apply, operation = std::move(operation), done = std::move(done)] { apply(operation, done); });
  }
}

void ModelActor::in_pool(std::function<void()> work) {
  ++pending_work_;
  boost::asio::post(pool_, [this, work = std::move(work)] {
    work();
    --pending_work_;
  });
}

void ModelActor::ask(v1::Query query, std::function<void(Result<v1::QueryResult>)> done) {
  post([this, query = std::move(query), done = std::move(done)] {
    if (!query.has_distance()) {
      done(model_.query(query));
      return;
    }
    // Measures every point against a mesh, which may have to be prepared first: not while a hand waits.
    in_pool([document = model_.document(), distance = query.distance(), done] {
      done(model::distance_to_reference(distance, document));
    });
  });
}

bool ModelActor::idle() const {
  return pending_work_ == 0;
}

ActorState ModelActor::state_now() const {
  ActorState state;
  state.document = model_.document();
  state.hash = model::document_hash(state.document);
  state.sequence = model_.sequence();
  state.tracking = tracking_;
  state.interaction = interaction_.statistics();
  state.meshes = meshes_.statistics();
  return state;
}

ActorState ModelActor::state() {
  if (stopped_) return state_now();
  std::promise<ActorState> promise;
  auto future = promise.get_future();
  post([&] { promise.set_value(state_now()); });
  return future.get();
}

}  // namespace handloft::session
