#pragma once
// Everything that comes from other processes: the model server's scene, the tracking daemon's poses and film.

#include <memory>

#include "client-hmd/main/client_key.h"
#include "client-hmd/main/frame_composer.h"
#include "client-hmd/main/options.h"
#include "client-hmd/mirror/model_feed.h"
#include "client-hmd/view/film_feed.h"
#include "client-hmd/view/tracking_feed.h"

namespace handloft::client {

/// What we were invited to be by a server elsewhere, as far as it matters here.
enum class Invited { somebody, owner };

class Feeds {
 public:
  /// Returns at once: each feed connects on a thread of its own. `clock` must outlive this. `tls`: for a
  /// model server elsewhere (net::tls_to()).
  Feeds(const HmdOptions& options, const net::Endpoint& model, const Clock& clock, Logger log,
        std::shared_ptr<const net::TlsContext> tls = nullptr, Invited invited = Invited::somebody);

  /// Once a frame. A daemon that started anew has other pictures.
  void follow_daemon();
  /// Once a frame. Whoever was invited to comment or to look comes as that instead. Errors: permission_denied
  /// in the server's words when it does not let us in, as long as it does not.
  Status follow_access();
  /// Once a frame: what other users do and say.
  void follow_users();
  /// For a camera that was switched to the head; nothing without a daemon.
  void want_film();

  /// The newest of everything, without waiting.
  FrameSources newest() const { return {model_->state(), tracking_.get(), film_.get(), &ghosts_, &pins_}; }
  ModelFeed& model() { return *model_; }
  TrackingFeed* tracking() { return tracking_.get(); }  ///< Null without a daemon.
  /// Capture to client, median; 0: unknown.
  double latency_ms() const;

 private:
  net::Endpoint server_;
  const Clock& clock_;
  std::optional<net::Endpoint> daemon_;
  Logger log_;
  ClientKey key_;
  FeedOptions joining_;
  std::unique_ptr<ModelFeed> model_;
  std::unique_ptr<TrackingFeed> tracking_;
  std::unique_ptr<FilmFeed> film_;
  std::uint64_t film_connects_ = 0;
  GhostTracker ghosts_;
  PinPlaces pins_;
};

}  // namespace handloft::client
