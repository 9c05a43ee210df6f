#pragma once
// The one thread that owns a model (architecture, "One model thread owns a document"): operations, queries
// and tracking frames come to it one after another, which is their total order; each change leaves a new
// scene, a value that other threads read. Tessellation, imports and exports run on a small pool, so that no
// hand waits for them.

#include <atomic>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/thread_pool.hpp>
#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "common/base/clock.h"
#include "common/base/log.h"
#include "common/base/result.h"
#include "proto/query.pb.h"
#include "proto/scene.pb.h"
#include "proto/tracking.pb.h"
#include "server-model/interaction/interaction.h"
#include "server-model/model/model.h"
#include "server-model/session/resolve_operation.h"
#include "server-model/session/script_target.h"
#include "server-model/stream/mesh_cache.h"
#include "server-model/stream/scene.h"
#include "server-model/stream/scene_builder.h"

namespace handloft::session {

struct ActorOptions {
  interaction::InteractionOptions interaction;
  stream::MeshCacheOptions meshes;
  std::uint64_t epoch = 0;  ///< Another one with every start.
  std::size_t max_pending_frames =
      64;  ///< Tracking frames that may wait: a second's worth. See push_frame().
  std::filesystem::path export_folder = ".";       ///< Where the palette's "Export" writes.
  std::shared_ptr<const exchange::CadKernel> cad;  ///< By what; as model::FileAccess::cad.
  /// How long presence tells what became of an export: as long as reading a file's name takes.
  Duration notice_for = std::chrono::seconds(5);
  std::size_t pool_threads = 1;  ///< Two cores: one for the model, one for the rest.
};

/// Called from the model's thread; must not block. Any may be empty.
struct ActorEvents {
  std::function<void()> on_scene;                        ///< There is a newer scene().
  std::function<void(const v1::Presence&)> on_presence;  ///< Of a hand.
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
  TrackingStatistics tracking;
  interaction::InteractionStatistics interaction;
  stream::MeshCacheStatistics meshes;
};

class ModelActor {
 public:
  using Outcome = model::ScriptTarget::Outcome;

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
  /// The daemon is gone: gestures in the air end (Interaction::finish()).
  void tracking_lost();

  /// `done` is called on the model's thread or the pool's. Thread-safe; the caller bounds how much it has
  /// under way.
  void submit(v1::Operation operation, model::FileAccess files, std::function<void(Result<Outcome>)> done);
  void ask(v1::Query query, std::function<void(Result<v1::QueryResult>)> done);

  /// The newest scene, never null. Thread-safe, cheap.
  stream::ScenePtr scene() const;
  /// No mesh is being made and nothing waits: scene() is final unless something new comes. Thread-safe.
  bool idle() const;
  /// Waits for its turn on the model's thread. Not from there.
  ActorState state();

  /// Ends the threads after what they are at; nothing is called afterwards. state() still works.
  void stop();

 private:
  void on_frame(const v1::TrackingFrame& frame);
  void count_sequence(const v1::TrackingFrame& frame);
  void publish_presence(const v1::TrackingFrame& frame);
  void publish_scene();
  void report(const interaction::FrameOutcome& outcome);
  void export_for_hand();
  void notify(std::string words);  ///< Hands' presence tells it for a while.
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
  interaction::Interaction interaction_;
  stream::MeshCache meshes_;
  stream::SceneBuilder builder_;
  std::int64_t capture_time_ns_ = 0;
  int frames_without_scene_ = 0;  ///< That changed it since it was published.
  std::optional<std::uint64_t> last_sequence_;
  TrackingStatistics tracking_;
  std::string notice_;
  TimePoint notice_until_;

  mutable std::mutex scene_mutex_;
  stream::ScenePtr scene_;

  std::mutex frames_mutex_;
  std::condition_variable frames_taken_;
  std::size_t pending_frames_ = 0;

  std::atomic<std::size_t> pending_work_ = 0;
  std::atomic<bool> stopped_ = false;
  boost::asio::thread_pool pool_;
  boost::asio::io_context context_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_;
  std::thread thread_;
};

}  // namespace handloft::session
