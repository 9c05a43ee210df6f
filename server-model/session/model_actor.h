#pragma once
// The one thread that owns a model (architecture, "One model thread owns a document"): operations, queries
// and tracking frames come to it one after another, which is their total order; each change leaves a new
// scene, a value that other threads read. Tessellation, imports and exports run on a small pool, so that no
// hand waits for them.

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>

#include "common/base/clock.h"
#include "common/base/log.h"
#include "common/base/result.h"
#include "proto/query.pb.h"
#include "proto/scene.pb.h"
#include "proto/session.pb.h"
#include "proto/tracking.pb.h"
#include "server-model/interaction/interaction.h"
#include "server-model/model/model.h"
#include "server-model/session/actor_threads.h"
#include "server-model/session/hand_inbox.h"
#include "server-model/session/hand_source.h"
#include "server-model/session/presence.h"
#include "server-model/session/resolve_operation.h"
#include "server-model/session/script_target.h"
#include "server-model/session/session_metrics.h"
#include "server-model/store/model_store.h"
#include "server-model/stream/mesh_cache.h"
#include "server-model/stream/scene.h"
#include "server-model/stream/scene_builder.h"

namespace handloft::session {

struct ActorOptions {
  interaction::InteractionOptions interaction;
  stream::MeshCacheOptions meshes;
  std::string name = "main";  ///< The model's, for figures.
  std::uint64_t epoch = 0;    ///< Another one with every start.
  std::size_t max_pending_frames =
      64;                          ///< Tracking frames that may wait: a second's worth. See push_frame().
  HandInboxOptions client_frames;  ///< That may wait of each client. See push_hand().
  std::filesystem::path export_folder = ".";       ///< Where the palette's "Export" writes.
  std::shared_ptr<const exchange::CadKernel> cad;  ///< By what; as model::FileAccess::cad.
  /// How long presence tells what became of an export: as long as reading a file's name takes.
  Duration notice_for = std::chrono::seconds(5);
  /// Keeps what is applied (serve --store); null: nothing is kept. The model that it gave back is the
  /// actor's.
  std::shared_ptr<store::ModelStore> store;
  interaction::LeaseOptions leases;
  /// A hand of which nothing was heard for so long lets others take the icons that it holds: as leases.
  Duration silence = std::chrono::seconds(5);
  enum class Acknowledge {
    applied,  ///< When the model has it: as quick as without a store, and a crash may lose it.
    durable,  ///< When it is on the disk. Viewers see it at once all the same.
  };
  Acknowledge acknowledge = Acknowledge::durable;  ///< When a client's operation is answered, with a store.
  std::shared_ptr<SessionMetrics> metrics = {};    ///< Counts what is done; null: nobody asks.
  std::size_t pool_threads = 1;                    ///< Two cores: one for the model, one for the rest.
  StartActorThreads threads = {};  ///< Empty: start_threads(pool_threads). Else queues that a test steps.
};

/// Called from the model's thread; must not block. Any may be empty.
struct ActorEvents {
  std::function<void()> on_scene;                        ///< There is a newer scene().
  std::function<void(const v1::Presence&)> on_presence;  ///< Of a hand, or that it is gone.
  std::function<void()> on_end_of_recording;
};

struct TrackingStatistics {
  std::uint64_t frames = 0;
  std::uint64_t gaps = 0;    ///< Frames that never came, by their sequence numbers.
  std::uint64_t resets = 0;  ///< The sequence began anew: another daemon.
};

/// What the model's thread knows when all is over, for the report.
struct ActorState {
  model::Document document;
  std::string hash;
  std::uint64_t sequence = 0;
  TrackingStatistics tracking;                     ///< The server's own.
  interaction::InteractionStatistics interaction;  ///< Of all hands there were.
  HandInboxStatistics client_frames;               ///< Of all clients there were.
  stream::MeshCacheStatistics meshes;
};

class ModelActor {
 public:
  using Outcome = model::ScriptTarget::Outcome;
  enum class LeaseWish : std::uint8_t { take, release };

  /// `clock` must outlive it.
  ModelActor(model::Model initial, ActorOptions options, ActorEvents events, const Clock& clock, Logger log);
  ~ModelActor();
  ModelActor(const ModelActor&) = delete;
  ModelActor& operator=(const ModelActor&) = delete;

  /// From any one thread but the model's own. Waits while max_pending_frames wait already, so that a replay
  /// goes as fast as the model and no faster; a live daemon leaves out frames instead. Returns at once after
  /// stop().
  void push_frame(v1::TrackingFrame frame);
  /// `feel` is told, on the model's thread, what the hand's glove should let it feel: short faint pulses when
  /// it takes hold of an icon, lets go, or is refused. It must not block. Thread-safe.
  void set_feel(std::function<void(const v1::GloveFeedback&)> feel);
  /// The daemon is gone: gestures of its hands in the air end (Interaction::finish()).
  void tracking_lost();

  /// A frame of a client's own hands (client_id not 0), read by read_client_frame(). The first one, or the
  /// first command, gives the client a workbench. Never waits; thread-safe, but one client's frames,
  /// commands and submits must come one after another to be done in that order.
  HandInbox::Taken push_hand(const HandOwner& owner, v1::TrackingFrame frame);
  /// A command of the palette by name. `done` as of submit(); of an export when the file is written. Errors:
  /// invalid_argument for an unknown command or hand, else what the model refuses.
  void command(const HandOwner& owner, const v1::HandCommand& command,
               std::function<void(Result<Outcome>)> done);
  /// The client is gone, in whatever way: what its hands have in the air is committed, since nobody saw them
  /// leave it and undo takes it back; its workbench is forgotten. Presence tells that it is gone.
  void hand_gone(const HandOwner& owner);
  /// Nothing more comes of any hand: all gestures in the air end, as with tracking_lost().
  void end_gestures();

  /// `done` is called on the model's thread, the pool's or the store's. Thread-safe; the caller bounds how
  /// much it has under way. `answer_when`: how safe it is to be by then; unspecified: as the options say.
  /// failed_precondition for what must be durable where nothing is kept. An operation that deforms what
  /// another client has leased is refused (leases.h). `allowed`, when not empty, is asked on the model's
  /// thread about the document that the operation meets: an error refuses it.
  using Allowed = std::function<Status(const model::Document&)>;
  void submit(v1::Operation operation, model::FileAccess files, std::function<void(Result<Outcome>)> done,
              Allowed allowed = {}, v1::SaveLevel answer_when = v1::SAVE_LEVEL_UNSPECIFIED);
  /// For who may not do this: what was answered when it was done (H3), by somebody who still might; `refused`
  /// when it was not. As submit().
  void answer_again(v1::Operation operation, Error refused, std::function<void(Result<Outcome>)> done,
                    v1::SaveLevel answer_when = v1::SAVE_LEVEL_UNSPECIFIED);
  /// As this client sees it: its own undo and redo.
  void ask(v1::Query query, std::function<void(Result<v1::QueryResult>)> done, std::uint64_t client_id = 0);

  /// A client sees the model from now on: scenes tell its own steps of history, and who it is where it has
  /// leased something. `joined` is called on the model's thread when scene() has that.
  void viewer_came(std::uint64_t client_id, const std::string& name, std::function<void()> joined);
  /// Its leases end.
  void viewer_gone(std::uint64_t client_id);
  /// It may shape no longer, and sees on: its leases end.
  void end_leases(std::uint64_t client_id);
  /// Leases an entity to a client, or ends that (U1). `done` is called on the model's thread. Errors:
  /// not_found, those of Leases::take().
  void lease(std::uint64_t client_id, const std::string& entity, LeaseWish wish,
             std::function<void(Status)> done);
  /// To be called a few times a second: ends what nobody has renewed.
  void tick();

  /// The newest scene, never null. Thread-safe, cheap.
  stream::ScenePtr scene() const;
  /// What goes with it to one client. Thread-safe, cheap.
  stream::Personal personal(const stream::Scene& scene, std::uint64_t client_id) const;
  /// No mesh is being made and nothing waits: scene() is final unless something new comes. Thread-safe.
  bool idle() const;
  /// Waits for its turn on the model's thread. Not from there.
  ActorState state();
  /// The same, and nothing else. Returns at once after stop().
  void settle();

  /// Ends the threads after what they are at, when all that was applied is durable or has failed to be;
  /// nothing is called afterwards. state() still works.
  void stop();

 private:
  /// Tells the metrics when an operation that came then is durable.
  std::function<void(Result<Outcome>)> counted(std::function<void(Result<Outcome>)> done, TimePoint came);
  /// At once, or when all that was applied is durable, so that answers keep their order. Then `done` is
  /// called on the store's thread.
  void answer_when_saved(Result<Outcome> outcome, const std::function<void(Result<Outcome>)>& done,
                         v1::SaveLevel answer_when = v1::SAVE_LEVEL_UNSPECIFIED);
  Result<Outcome> apply(const v1::Operation& resolved, const Allowed& allowed);
  /// Viewers are told, once for all that is committed together, that more is durable now.
  void tell_when_durable();
  void on_frame(HandSource& source, const v1::TrackingFrame& frame);
  void count_sequence(const v1::TrackingFrame& frame);
  void on_command(const HandOwner& owner, const v1::HandCommand& command,
                  const std::function<void(Result<Outcome>)>& done);
  HandSource& tracked() { return sources_.at(0); }  ///< The server's own.
  HandSource& source_of(const HandOwner& owner);
  std::shared_ptr<HandInbox> inbox_of(std::uint64_t client_id);
  void seal_inbox(std::uint64_t client_id);
  /// Of the frame's hands, and of so many at the least.
  void publish_presence(HandSource& source, int at_least = 1);
  void publish_scene();
  void report(const HandSource& source, const interaction::FrameOutcome& outcome);
  /// For lines about what its hands do.
  Logger log_of(const HandOwner& owner) const;
  /// `done` may be empty.
  void export_for_hand(std::uint64_t client_id, std::function<void(Result<Outcome>)> done);
  void notify(std::uint64_t client_id, std::string words);  ///< Its hands' presence tells it for a while.
  ActorState state_now() const;
  void post(std::function<void()> work);     ///< To the model's thread.
  void in_pool(std::function<void()> work);  ///< To a thread beside it.

  ActorEvents events_;
  std::function<void(const v1::GloveFeedback&)> feel_;  ///< Owned by the model's thread.
  ActorOptions options_;
  const Clock& clock_;
  Logger log_;
  RateLimit problem_rate_{std::chrono::seconds(1)};  ///< A fault may come with every frame.

  // Owned by the model's thread.
  model::Model model_;
  interaction::ClaimsPtr claims_ = std::make_shared<interaction::Claims>();
  std::map<std::uint64_t, HandSource> sources_;    ///< By client; 0: the server's own, always there.
  interaction::InteractionStatistics past_hands_;  ///< Of clients that are gone.
  stream::MeshCache meshes_;
  stream::SceneBuilder builder_;
  std::set<std::uint64_t> viewers_;
  std::int64_t capture_time_ns_ = 0;
  int frames_without_scene_ = 0;  ///< That changed it since it was published.
  std::optional<std::uint64_t> last_sequence_;
  TrackingStatistics tracking_;

  mutable std::mutex scene_mutex_;
  stream::ScenePtr scene_;

  std::mutex frames_mutex_;
  std::condition_variable frames_taken_;
  std::size_t pending_frames_ = 0;
  std::atomic<std::size_t> pending_client_frames_ = 0;
  mutable std::mutex inboxes_mutex_;
  std::map<std::uint64_t, std::shared_ptr<HandInbox>> inboxes_;  ///< By client.
  HandInboxStatistics past_frames_;                              ///< Of clients that are gone.

  std::uint64_t awaited_sequence_ = 0;  ///< Of what tell_when_durable() waits for.
  std::atomic<bool> storage_news_ = false;
  std::atomic<std::size_t> pending_work_ = 0;
  std::atomic<bool> stopped_ = false;
  ActorThreads threads_;
};

}  // namespace handloft::session
