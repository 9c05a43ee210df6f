#include "server-model/session/model_actor.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "server-model/model/canonical.h"
#include "server-model/session/palette_export.h"
#include "server-model/session/presence.h"
#include "server-model/session/shown_name.h"

namespace handloft::session {
namespace {

/// While frames wait (a replay), only every so many of them make a scene; a live hand never has frames
/// waiting.
constexpr int max_frames_without_scene = 4;

/// What a hand's presence says while it lies on the palette's "Export" (palette_commands.cpp).
constexpr std::string_view export_words = "export";

}  // namespace

ModelActor::ModelActor(model::Model initial, ActorOptions options, ActorEvents events, const Clock& clock,
                       Logger log)
    : events_(std::move(events)),
      options_(std::move(options)),
      clock_(clock),
      log_(std::move(log)),
      model_(std::move(initial)),
      meshes_([this](std::function<void()> job) { in_pool(std::move(job)); },
              [this] { post([this] { publish_scene(); }); }, options_.meshes),
      builder_(options_.epoch, meshes_),
      threads_(options_.threads ? options_.threads() : start_threads(options_.pool_threads)) {
  // There, since meshes that publishing orders may be done before it has ended, and publish again.
  threads_.model->run_and_wait([this] {
    claims_->leases = interaction::Leases([&time = clock_] { return time.now(); }, options_.leases);
    if (options_.store && options_.metrics) options_.store->time_commits(options_.metrics->commits());
    source_of({});
    publish_scene();
  });
}

ModelActor::~ModelActor() {
  stop();
}

void ModelActor::stop() {
  stopped_ = true;
  { const std::lock_guard lock(frames_mutex_); }
  frames_taken_.notify_all();
  threads_.model->stop();
  threads_.pool->stop();
  if (options_.store) options_.store->flush();
}

void ModelActor::post(std::function<void()> work) {
  ++pending_work_;
  threads_.model->post([this, work = std::move(work)] {
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
  post([this, frame = std::move(frame)] {
    {
      const std::lock_guard lock(frames_mutex_);
      --pending_frames_;
    }
    frames_taken_.notify_one();
    count_sequence(frame);
    on_frame(tracked(), frame);
    if (frame.end_of_recording() && events_.on_end_of_recording) events_.on_end_of_recording();
  });
}

void ModelActor::set_feel(std::function<void(const v1::GloveFeedback&)> feel) {
  post([this, feel = std::move(feel)]() mutable { feel_ = std::move(feel); });
}

void ModelActor::tracking_lost() {
  post([this] {
    report(tracked(), tracked().interaction.finish());
    publish_scene();
  });
}

void ModelActor::end_gestures() {
  post([this] {
    for (auto& [id, source] : sources_) report(source, source.interaction.finish());
    publish_scene();
  });
}

HandSource& ModelActor::source_of(const HandOwner& owner) {
  claims_->leases.introduce(owner.client_id, owner.name);
  return sources_.try_emplace(owner.client_id, model_, options_.interaction, claims_, owner).first->second;
}

std::shared_ptr<HandInbox> ModelActor::inbox_of(std::uint64_t client_id) {
  const std::lock_guard lock(inboxes_mutex_);
  std::shared_ptr<HandInbox>& inbox = inboxes_[client_id];
  if (!inbox) inbox = std::make_shared<HandInbox>(options_.client_frames);
  return inbox;
}

void ModelActor::seal_inbox(std::uint64_t client_id) {
  const std::lock_guard lock(inboxes_mutex_);
  if (const auto inbox = inboxes_.find(client_id); inbox != inboxes_.end()) inbox->second->seal();
}

HandInbox::Taken ModelActor::push_hand(const HandOwner& owner, v1::TrackingFrame frame) {
  frame.set_end_of_recording(false);  // Only the server's own tracking ends a session.
  std::shared_ptr<HandInbox> inbox = inbox_of(owner.client_id);
  const HandInbox::Taken taken = inbox->push(std::move(frame), clock_.now());
  if (taken != HandInbox::Taken::waits) return taken;
  ++pending_client_frames_;
  post([this, owner, inbox = std::move(inbox)] {
    --pending_client_frames_;
    if (const auto next = inbox->pop()) on_frame(source_of(owner), *next);
  });
  return taken;
}

void ModelActor::hand_gone(const HandOwner& owner) {
  post([this, owner] {
    {
      const std::lock_guard lock(inboxes_mutex_);
      if (const auto inbox = inboxes_.find(owner.client_id); inbox != inboxes_.end()) {
        past_frames_ += inbox->second->statistics();
        inboxes_.erase(inbox);
      }
    }
    const auto source = sources_.find(owner.client_id);
    if (owner.client_id == 0 || source == sources_.end()) return;
    report(source->second, source->second.interaction.finish());
    past_hands_ += source->second.interaction.statistics();
    sources_.erase(source);
    publish_scene();
    if (!events_.on_presence) return;
    for (int hand = 0; hand < static_cast<int>(interaction::Interaction::max_hands); ++hand) {
      v1::Presence gone;
      gone.set_client_id(owner.client_id);
      gone.set_name(hand_name(owner, hand));
      gone.set_gone(true);
      events_.on_presence(clean_presence(std::move(gone)));
    }
  });
}

void ModelActor::command(const HandOwner& owner, const v1::HandCommand& command,
                         std::function<void(Result<Outcome>)> done) {
  seal_inbox(owner.client_id);
  post([this, owner, command, done = std::move(done)] { on_command(owner, command, done); });
}

void ModelActor::on_command(const HandOwner& owner, const v1::HandCommand& command,
                            const std::function<void(Result<Outcome>)>& done) {
  const auto known = palette_command_named(command.command());
  if (!known) {
    done(make_error(ErrorCode::invalid_argument,
                    "found \"" + shown_name(command.command()) + "\", expected a command of the palette",
                    "hand_command.command"));
    return;
  }
  if (command.hand() >= interaction::Interaction::max_hands) {
    done(make_error(ErrorCode::invalid_argument,
                    "found " + std::to_string(command.hand()) + ", expected less than " +
                        std::to_string(interaction::Interaction::max_hands),
                    "hand_command.hand"));
    return;
  }
  HandSource& source = source_of(owner);
  interaction::FrameOutcome outcome;
  const interaction::CommandAnswer answer = source.interaction.command(command.hand(), *known, outcome);
  if (outcome.scene_changed) publish_scene();
  report(source, outcome);
  publish_presence(source, static_cast<int>(command.hand()) + 1);
  if (!answer.refusal.empty()) {
    answer_when_saved(make_error(answer.refused_as, answer.refusal, "hand_command.command"), done);
  } else if (!outcome.exports.empty()) {
    export_for_hand(owner.client_id, done);
  } else {
    Outcome result;
    for (const model::Submitted& submitted : outcome.submitted) {
      result.sequence = submitted.sequence;
      for (std::string& id : submitted.changes.all()) result.entities.push_back(std::move(id));
      result.notes.insert(result.notes.end(), submitted.notes.begin(), submitted.notes.end());
    }
    answer_when_saved(std::move(result), done);
  }
}

void ModelActor::count_sequence(const v1::TrackingFrame& frame) {
  ++tracking_.frames;
  if (last_sequence_ && frame.sequence() > *last_sequence_)
    tracking_.gaps += frame.sequence() - *last_sequence_ - 1;
  if (last_sequence_ && frame.sequence() <= *last_sequence_) ++tracking_.resets;
  last_sequence_ = frame.sequence();
}

void ModelActor::on_frame(HandSource& source, const v1::TrackingFrame& frame) {
  std::size_t waiting = pending_client_frames_;
  {
    const std::lock_guard lock(frames_mutex_);
    waiting += pending_frames_;
  }
  source.heard_at = clock_.now();
  const std::uint64_t ignored = source.interaction.statistics().frames_ignored;
  const interaction::FrameOutcome outcome = source.interaction.on_frame(frame);
  if (outcome.scene_changed) {
    capture_time_ns_ = frame.capture_time_ns();
    ++frames_without_scene_;
  }
  if (frames_without_scene_ > 0 && (waiting == 0 || frames_without_scene_ >= max_frames_without_scene))
    publish_scene();
  report(source, outcome);
  for (std::size_t i = 0; i < outcome.exports.size(); ++i) export_for_hand(source.owner.client_id, {});
  if (feel_ && source.owner.client_id == 0) {
    for (const interaction::Pulse pulse : outcome.pulses) feel_(glove_feedback(pulse));
  }
  if (source.interaction.statistics().frames_ignored != ignored) return;
  source.last_frame = frame;
  publish_presence(source);
}

Logger ModelActor::log_of(const HandOwner& owner) const {
  return owner.log ? owner.log->component("model").with("model", options_.name) : log_;
}

void ModelActor::report(const HandSource& source, const interaction::FrameOutcome& outcome) {
  if (outcome.submitted.empty() && outcome.problems.empty()) return;
  if (options_.metrics) options_.metrics->applied_by_hand(options_.name, outcome.submitted.size());
  const Logger log = log_of(source.owner);
  for (const model::Submitted& submitted : outcome.submitted) {
    log.debug("{}: {} ({})", source.owner.name, submitted.words, submitted.sequence);
    for (const std::string& note : submitted.notes) log.info("{}", note);
    for (const std::string& gesture : submitted.cancelled_gestures) log.warning("{}", gesture);
  }
  for (const std::string& problem : outcome.problems) {
    if (const auto kept_back = problem_rate_.allow(clock_.now())) {
      log.warning("{}{}", problem, *kept_back > 0 ? " (and " + std::to_string(*kept_back) + " more)" : "");
    }
  }
}

void ModelActor::publish_presence(HandSource& source, int at_least) {
  if (!events_.on_presence) return;
  const v1::TrackingFrame& frame = source.last_frame;
  const int hands = std::min(frame.hands_size(), static_cast<int>(interaction::Interaction::max_hands));
  for (int i = 0; i < std::max(at_least, hands); ++i) {
    v1::Presence presence = hand_presence(frame, i, source.interaction, source.owner);
    // What the hand does now is more important than what became of its export.
    if (!source.notice.empty() && (presence.tool().empty() || presence.tool() == export_words)) {
      presence.set_tool(source.notice);
      presence = clean_presence(std::move(presence));
    }
    events_.on_presence(presence);
  }
  if (!source.notice.empty() && clock_.now() > source.notice_until) source.notice.clear();
}

void ModelActor::export_for_hand(std::uint64_t client_id, std::function<void(Result<Outcome>)> done) {
  in_pool([this, client_id, done = std::move(done), document = model_.document()] {
    auto exported = model::export_from_palette(document, options_.export_folder, options_.cad);
    post([this, client_id, done, exported = std::move(exported)] {
      const auto source = sources_.find(client_id);
      const Logger log = source == sources_.end() ? log_ : log_of(source->second.owner);
      if (!exported) {
        log.warning("export refused: {}", exported.error().describe());
        notify(client_id, "export refused: " + exported.error().message);
        if (done) done(exported.error());
        return;
      }
      log.info("exported \"{}\"", exported->path.string());
      for (const std::string& note : exported->notes) log.info("{}", note);
      const std::string words = "exported " + exported->path.filename().string();
      notify(client_id, words);
      if (!done) return;
      Outcome outcome;
      outcome.entities = exported->entities;
      outcome.notes = exported->notes;
      outcome.notes.insert(outcome.notes.begin(), words);
      done(std::move(outcome));
    });
  });
}

void ModelActor::notify(std::uint64_t client_id, std::string words) {
  const auto source = sources_.find(client_id);
  if (source == sources_.end()) return;  // Gone meanwhile.
  source->second.notice = std::move(words);
  source->second.notice_until = clock_.now() + options_.notice_for;
  // A client may command without moving a hand.
  if (client_id != 0) publish_presence(source->second);
}

void ModelActor::publish_scene() {
  frames_without_scene_ = 0;
  stream::HandMarks marks;
  for (const auto& [id, source] : sources_) add_marks(source.interaction, marks);
  for (const auto& [entity, lease] : claims_->leases.current()) {
    marks.leases.emplace(entity, stream::LeaseMark{lease.client_id, lease.name});
  }
  stream::ScenePtr scene = builder_.build(model_, capture_time_ns_, marks, viewers_);
  {
    const std::lock_guard lock(scene_mutex_);
    scene_.swap(scene);
  }
  if (events_.on_scene) events_.on_scene();
  tell_when_durable();
}

stream::ScenePtr ModelActor::scene() const {
  const std::lock_guard lock(scene_mutex_);
  return scene_;
}

void ModelActor::in_pool(std::function<void()> work) {
  ++pending_work_;
  threads_.pool->post([this, work = std::move(work)] {
    work();
    --pending_work_;
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
  state.interaction = past_hands_;
  for (const auto& [id, source] : sources_) state.interaction += source.interaction.statistics();
  {
    const std::lock_guard lock(inboxes_mutex_);
    state.client_frames = past_frames_;
    for (const auto& [id, inbox] : inboxes_) state.client_frames += inbox->statistics();
  }
  state.meshes = meshes_.statistics();
  return state;
}

void ModelActor::settle() {
  if (!stopped_) threads_.model->run_and_wait([] {});
}

ActorState ModelActor::state() {
  if (stopped_) return state_now();
  ActorState state;
  threads_.model->run_and_wait([&] { state = state_now(); });
  return state;
}

}  // namespace handloft::session
