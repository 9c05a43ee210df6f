#include "common/net/metrics_server.h"

#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/dispatch.hpp>
#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <cerrno>
#include <chrono>
#include <list>
#include <utility>

#include "common/base/version.h"

namespace handloft::net {

namespace {
namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
using Stream = beast::basic_stream<asio::generic::stream_protocol>;

constexpr std::size_t longest_request_bytes = 8 << 10;
constexpr std::size_t most_connections = 32;
constexpr auto patience = std::chrono::seconds(5);
constexpr auto pause_after_failure = std::chrono::milliseconds(100);

http::response<http::string_body> answer(const http::request<http::empty_body>& request,
                                         const std::string& program, const std::function<std::string()>& text,
                                         const HealthChecks& health) {
  http::response<http::string_body> response;
  response.version(request.version());
  response.keep_alive(false);
  response.set(http::field::server, program_version(program));
  response.set(http::field::content_type, "text/plain; version=0.0.4; charset=utf-8");
  if (request.method() != http::verb::get && request.method() != http::verb::head) {
    response.result(http::status::method_not_allowed);
    response.set(http::field::allow, "GET, HEAD");
    response.body() = "expected GET /metrics\n";
  } else if (request.target() == "/healthz" || request.target() == "/readyz") {
    const auto& check = request.target() == "/healthz" ? health.alive : health.ready;
    const Status status = check ? check() : Status();
    response.set(http::field::content_type, "text/plain; charset=utf-8");
    if (!status) response.result(http::status::service_unavailable);
    response.body() = status ? "ok\n" : status.error().describe() + "\n";
  } else if (request.target() != "/metrics") {
    response.result(http::status::not_found);
    response.body() = "expected /metrics, /healthz or /readyz\n";
  } else {
    response.body() = text();
  }
  response.prepare_payload();
  if (request.method() == http::verb::head) response.body().clear();
  return response;
}
}  // namespace

struct MetricsServer::Implementation : std::enable_shared_from_this<MetricsServer::Implementation> {
  Implementation(const asio::any_io_executor& io, Listener taken, std::string its_program,
                 std::function<std::string()> asked, Logger logger, HealthChecks checks)
      : strand(asio::make_strand(io)),
        acceptor(strand, ::dup(taken.fd.get())),
        pause(strand),
        listener(std::move(taken)),
        program(std::move(its_program)),
        text(std::move(asked)),
        log(std::move(logger)),
        health(std::move(checks)) {}

  asio::strand<asio::any_io_executor> strand;
  asio::posix::stream_descriptor acceptor;
  asio::steady_timer pause;
  Listener listener;
  std::string program;
  std::function<std::string()> text;
  Logger log;
  HealthChecks health;
  std::list<std::shared_ptr<Stream>> connections;  ///< The oldest first.

  asio::awaitable<void> accept_all() {
    boost::system::error_code error;
    while (acceptor.is_open()) {
      const int fd = ::accept4(listener.fd.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
      if (fd >= 0) {
        FileDescriptor peer(fd);
        if (!check_peer(fd, listener.endpoint)) continue;
        // Those who say nothing must not keep out who asks how the server is: the oldest goes.
        if (connections.size() >= most_connections) {
          connections.front()->socket().close(error);
          connections.pop_front();
        }
        serve(std::move(peer));
        continue;
      }
      if (errno == EINTR || errno == ECONNABORTED) continue;
      if (errno == EAGAIN || errno == EWOULDBLOCK) {
        co_await acceptor.async_wait(asio::posix::stream_descriptor::wait_read,
                                     asio::redirect_error(asio::use_awaitable, error));
      } else {  // Out of descriptors, for now.
        pause.expires_after(pause_after_failure);
        co_await pause.async_wait(asio::redirect_error(asio::use_awaitable, error));
      }
      if (error) co_return;
    }
  }

  void serve(FileDescriptor peer) {
    const int family = listener.endpoint.kind == Endpoint::Kind::unix_socket ? AF_UNIX : AF_INET;
    auto stream = std::make_shared<Stream>(strand);
    boost::system::error_code error;
    stream->socket().assign(asio::generic::stream_protocol(family, 0), peer.get(), error);
    if (error) return;
    (void)peer.release();
    connections.push_back(stream);
    asio::co_spawn(
        strand,
        [self = shared_from_this(), stream]() -> asio::awaitable<void> {
          co_await self->converse(*stream);
          self->connections.remove(stream);
        },
        asio::detached);
  }

  asio::awaitable<void> converse(Stream& stream) {
    boost::system::error_code error;
    beast::flat_buffer buffer(longest_request_bytes);
    http::request_parser<http::empty_body> parser;
    parser.header_limit(longest_request_bytes);
    stream.expires_after(patience);
    // A body, which nothing that is asked here has, is left unread, and who sends one is told so.
    co_await http::async_read_header(stream, buffer, parser,
                                     asio::redirect_error(asio::use_awaitable, error));
    if (error) co_return;
    http::response<http::string_body> response = answer(parser.get(), program, text, health);
    http::response_serializer<http::string_body> serializer(response);
    stream.expires_after(patience);
    co_await http::async_write(stream, serializer, asio::redirect_error(asio::use_awaitable, error));
    stream.socket().shutdown(asio::socket_base::shutdown_send, error);
  }
};

MetricsServer::MetricsServer(std::shared_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
MetricsServer::~MetricsServer() {
  stop();
}

Result<std::unique_ptr<MetricsServer>> MetricsServer::listen(const asio::any_io_executor& executor,
                                                             const Endpoint& endpoint, std::string program,
                                                             std::function<std::string()> text, Logger log,
                                                             HealthChecks health) {
  Result<Listener> listener = listen_on(endpoint);
  if (!listener) return listener.error();
  auto implementation = std::make_shared<Implementation>(executor, std::move(*listener), std::move(program),
                                                         std::move(text), std::move(log), std::move(health));
  asio::co_spawn(
      implementation->strand,
      [implementation]() -> asio::awaitable<void> { co_await implementation->accept_all(); }, asio::detached);
  return std::unique_ptr<MetricsServer>(new MetricsServer(std::move(implementation)));
}

const Endpoint& MetricsServer::endpoint() const {
  return implementation_->listener.endpoint;
}

void MetricsServer::stop() {
  asio::dispatch(implementation_->strand, [self = implementation_] {
    boost::system::error_code ignored;
    self->acceptor.close(ignored);
    self->pause.cancel();
    close_listener(self->listener);
  });
}

}  // namespace handloft::net
