#include "server-model/session/server.h"

#include <atomic>
#include <utility>

#include "server-model/session/peers.h"

namespace handloft::session {
namespace {

/// Each endpoint numbers its clients from a multiple of this, so that all have different ids.
constexpr int endpoint_shift = 40;

}  // namespace

struct Server::Implementation {
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
                                              const Logger& log, std::function<void()> on_end_of_recording) {
  if (endpoints.empty()) return make_error(ErrorCode::invalid_argument, "found no endpoint", "listen");
  options.net.roles = {v1::ROLE_VIEWER, v1::ROLE_EDITOR};
  net::ServerOptions net = options.net;
  const std::uint64_t first_client_id = net.first_client_id;
  auto implementation = std::make_unique<Implementation>();
  implementation->peers =
      Peers::start(std::move(initial), std::move(options), clock, log, std::move(on_end_of_recording));
  for (std::size_t i = 0; i < endpoints.size(); ++i) {
    net.first_client_id = (static_cast<std::uint64_t>(i) << endpoint_shift) + first_client_id;
    auto server = net::MessageServer::listen(executor, endpoints[i], net,
                                             implementation->peers->events(endpoints[i].kind), clock,
                                             log.component("net"));
    if (!server) {
      implementation->peers->actor().stop();
      return server.error();
    }
    implementation->servers.push_back(*std::move(server));
  }
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

LatencySummary Server::capture_to_delta() const {
  return implementation_->peers->capture_to_delta();
}

void Server::stop() {
  if (implementation_->stopped.exchange(true)) return;
  implementation_->peers->close();
  for (const auto& server : implementation_->servers) server->stop();
  implementation_->peers->actor().stop();
}

}  // namespace handloft::session
