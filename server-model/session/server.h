#pragma once
// The sockets around a model: who is there, what they may do, and what each is sent (architecture ideas 1 and
// 5; PROTOCOL.md). Viewers read, editors also change; everybody sees the same scene in the same order of
// operations; a slow, broken or hostile peer harms only itself.

#include <boost/asio/any_io_executor.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/log.h"
#include "common/net/message_server.h"
#include "server-model/session/latency.h"
#include "server-model/session/model_actor.h"
#include "server-model/session/room.h"
#include "server-model/session/server_options.h"

namespace handloft::session {

class Server {
 public:
  /// Listens on all endpoints, and on what systemd listens on for us (`adopted`), and starts the model's
  /// thread. `executor` must run until stop() and the closing of connections are over; `clock` must outlive
  /// the server. `on_end_of_recording` comes from the model's thread.
  static Result<std::unique_ptr<Server>> start(const boost::asio::any_io_executor& executor,
                                               const std::vector<net::Endpoint>& endpoints,
                                               model::Model initial, ServerOptions options,
                                               const Clock& clock, const Logger& log,
                                               std::function<void()> on_end_of_recording = {},
                                               std::vector<net::Listener> adopted = {});
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  std::vector<net::Endpoint> endpoints() const;  ///< As bound.
  ModelActor& actor();

  /// Every viewer has been given the newest scene and nothing waits in its outbox. Stalled viewers count as
  /// not.
  bool flushed() const;
  std::size_t viewer_count() const;
  std::size_t peer_count() const;  ///< Viewers and those that have not joined.
  std::uint64_t clients_served() const;
  std::vector<ClientFigures> clients() const;  ///< Of those who are there, for metrics.
  std::vector<ModelFigures> models() const;    ///< That are open, the first one first.
  stream::PackCacheStatistics packs() const;   ///< What their viewers share.
  /// Waits until all that was applied is on the disk or has failed to be, and told.
  void flush() const;
  /// From the capture of a tracking frame to the composing of the first delta that shows it, per viewer.
  LatencySummary capture_to_delta() const;
  std::vector<RoomPtr> open_rooms() const;
  /// Other limits of clients, for who comes from now on: those of `options` that MessageServer::set_limits()
  /// and Peers::set_limits() take.
  void set_limits(const ServerOptions& options);

  /// Sends what waits, tells everybody that the server stops, closes them and ends the model's thread.
  void stop();

 private:
  struct Implementation;
  explicit Server(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace handloft::session
