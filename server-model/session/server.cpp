#include "server-model/session/server.h"

#include <algorithm>
#include <atomic>
#include <boost/asio/dispatch.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>
#include <chrono>
#include <utility>

#include "server-model/session/peers.h"

namespace handloft::session {
namespace {

/// Each endpoint numbers its clients from a multiple of this, so that all have different ids.
constexpr int endpoint_shift = 48;
/// Who is revoked is gone within a second.
constexpr std::chrono::milliseconds look_every{200};

/// What is to be looked at again and again: Peers::tick().
class Watch : public std::enable_shared_from_this<Watch> {
 public:
  Watch(const boost::asio::any_io_executor& executor, const std::shared_ptr<Peers>& peers)
      : strand_(boost::asio::make_strand(executor)), timer_(strand_), peers_(peers) {}

  void next() {
    timer_.expires_after(look_every);
    timer_.async_wait([self = shared_from_this()](const boost::system::error_code& error) {
      const auto peers = self->peers_.lock();
      if (error || !peers || self->stopped_) return;
      peers->tick();
      self->next();
    });
  }
  void stop() {
    stopped_ = true;
    boost::asio::dispatch(strand_, [self = shared_from_this()] { self->timer_.cancel(); });
  }

 private:
  boost::asio::strand<boost::asio::any_io_executor> strand_;
  boost::asio::steady_timer timer_;
  std::weak_ptr<Peers> peers_;
  std::atomic<bool> stopped_ = false;
};

}  // namespace

namespace {

/// Where the others' hands are is drawn 60 to 120 times a second; one presence at a time for each of them
/// would cost the server a write and the receiver a waking each.
constexpr std::chrono::milliseconds presences_apart{4};

net::ServerOptions net_options(const ServerOptions& options) {
  net::ServerOptions net = options.net;
  net.states_apart = presences_apart;
  net.outbox.max_queued_bytes = options.client_memory.answers_bytes;
  net.outbox.max_slots = options.client_memory.max_presences;
  net.outbox.max_slot_bytes = options.client_memory.presence_bytes;
  net.outbox.max_notice_bytes = options.client_memory.notices_bytes;
  return net;
}

}  // namespace

struct Server::Implementation {
  std::shared_ptr<Watch> watch;
  std::shared_ptr<Peers> peers;
  std::vector<std::unique_ptr<net::MessageServer>> servers;
  std::atomic<bool> stopped = false;
};

Server::Server(std::unique_ptr<Implementation> implementation) : implementation_(std::move(implementation)) {}

Server::~Server() {
  stop();
}

Result<std::unique_ptr<Server>> Server::start(const boost::asio::any_io_executor& executor,
                                              const std::vector<net::Endpoint>& endpoints,
                                              model::Model initial, ServerOptions options, const Clock& clock,
                                              const Logger& log, std::function<void()> on_end_of_recording,
                                              std::vector<net::Listener> adopted) {
  if (endpoints.empty() && adopted.empty())
    return make_error(ErrorCode::invalid_argument, "found no endpoint", "listen");
  options.net.roles = {v1::ROLE_VIEWER, v1::ROLE_COMMENTER, v1::ROLE_EDITOR, v1::ROLE_OWNER};
  const bool with_tls = std::any_of(endpoints.begin(), endpoints.end(), [](const net::Endpoint& each) {
    return each.kind == net::Endpoint::Kind::tls;
  });
  if (with_tls && !options.net.tls) {
    if (!options.gate)
      return make_error(ErrorCode::failed_precondition, "a tls: endpoint needs users: --access FILE",
                        "listen");
    auto tls = options.gate->server_tls();
    if (!tls) return tls.error();
    options.net.tls = *std::move(tls);
  }
  net::ServerOptions net = net_options(options);
  const std::uint64_t first_client_id = net.first_client_id;
  auto implementation = std::make_unique<Implementation>();
  implementation->peers =
      Peers::start(std::move(initial), std::move(options), clock, log, std::move(on_end_of_recording));
  for (std::size_t i = 0; i < endpoints.size() + adopted.size(); ++i) {
    net.first_client_id = (static_cast<std::uint64_t>(i) << endpoint_shift) + first_client_id;
    const bool is_adopted = i >= endpoints.size();
    const net::Endpoint& endpoint = is_adopted ? adopted[i - endpoints.size()].endpoint : endpoints[i];
    net::ServerEvents events = implementation->peers->events(endpoint.kind);
    auto server = is_adopted ? net::MessageServer::serve(executor, std::move(adopted[i - endpoints.size()]),
                                                         net, std::move(events), clock, log.component("net"))
                             : net::MessageServer::listen(executor, endpoint, net, std::move(events), clock,
                                                          log.component("net"));
    if (!server) {
      implementation->peers->stop();
      return server.error();
    }
    implementation->servers.push_back(*std::move(server));
  }
  implementation->watch = std::make_shared<Watch>(executor, implementation->peers);
  implementation->watch->next();
  return std::unique_ptr<Server>(new Server(std::move(implementation)));
}

std::vector<net::Endpoint> Server::endpoints() const {
  std::vector<net::Endpoint> result;
  for (const auto& server : implementation_->servers) result.push_back(server->endpoint());
  return result;
}

ModelActor& Server::actor() {
  return implementation_->peers->actor();
}

bool Server::flushed() const {
  return implementation_->peers->flushed();
}

std::size_t Server::viewer_count() const {
  return implementation_->peers->viewer_count();
}

std::size_t Server::peer_count() const {
  return implementation_->peers->peer_count();
}

std::uint64_t Server::clients_served() const {
  return implementation_->peers->clients_served();
}

std::vector<ClientFigures> Server::clients() const {
  return implementation_->peers->clients();
}

stream::PackCacheStatistics Server::packs() const {
  return implementation_->peers->packs();
}

std::vector<ModelFigures> Server::models() const {
  return implementation_->peers->models();
}

std::vector<RoomPtr> Server::open_rooms() const {
  return implementation_->peers->rooms().open_rooms();
}

void Server::set_limits(const ServerOptions& options) {
  const net::ServerOptions net = net_options(options);
  for (const auto& server : implementation_->servers) server->set_limits(net);
  implementation_->peers->set_limits(
      {options.max_pending_requests, options.max_pending_bytes, options.client_memory.scene_bytes});
}

void Server::flush() const {
  implementation_->peers->flush();
}

LatencySummary Server::capture_to_delta() const {
  return implementation_->peers->capture_to_delta();
}

void Server::stop() {
  if (implementation_->stopped.exchange(true)) return;
  implementation_->watch->stop();
  implementation_->peers->close();
  for (const auto& server : implementation_->servers)
    server->stop(make_error(ErrorCode::cancelled, "the server stops"));
  implementation_->peers->stop();
}

}  // namespace handloft::session
