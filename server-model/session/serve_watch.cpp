#include "server-model/session/serve_watch.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cstdlib>
#include <utility>

#include "common/net/metrics_server.h"

namespace handloft::session {

namespace {

using namespace std::chrono_literals;

constexpr std::chrono::milliseconds beat_every = 1s;
/// The largest of what one operation may take: a solve of a large surface on a loaded computer.
constexpr Duration alive_within = 30s;

}  // namespace

struct ServeWatch::Implementation : std::enable_shared_from_this<ServeWatch::Implementation> {
  Implementation(const boost::asio::any_io_executor& executor, std::shared_ptr<SessionMetrics> counted,
                 net::ServiceManager& manager, WatchHooks asked, const Clock& used)
      : timer(executor),
        metrics(std::move(counted)),
        service(manager),
        hooks(std::move(asked)),
        clock(used),
        answered_ns(to_ns(used.now())) {}

  void beat() {
    if (stopped) return;
    if (!waiting.exchange(true)) {
      hooks.ask_model([weak = weak_from_this()] {
        const auto self = weak.lock();
        if (!self) return;
        self->answered_ns = to_ns(self->clock.now());
        self->waiting = false;
        if (!self->stopped) self->service.alive();
      });
    }
    const auto interval = service.watchdog_interval();
    timer.expires_after(interval ? std::min(*interval, beat_every) : beat_every);
    timer.async_wait([weak = weak_from_this()](const boost::system::error_code& error) {
      const auto self = weak.lock();
      if (self && !error) self->beat();
    });
  }

  Status alive() const {
    const Duration silence = clock.now() - from_ns(answered_ns);
    if (silence <= alive_within) return {};
    return make_error(ErrorCode::timeout,
                      fmt::format("the model's thread has not answered for {} s",
                                  std::chrono::duration_cast<std::chrono::seconds>(silence).count()),
                      "model");
  }

  boost::asio::steady_timer timer;
  std::shared_ptr<SessionMetrics> metrics;
  net::ServiceManager& service;
  WatchHooks hooks;
  const Clock& clock;
  std::unique_ptr<net::MetricsServer> server;
  std::atomic<std::int64_t> answered_ns;
  std::atomic<bool> waiting = false;
  std::atomic<bool> stopped = false;
};

ServeWatch::ServeWatch(std::shared_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}

ServeWatch::~ServeWatch() {
  stop();
}

Result<std::unique_ptr<ServeWatch>> ServeWatch::start(const boost::asio::any_io_executor& executor,
                                                      const std::string& metrics_at,
                                                      std::shared_ptr<SessionMetrics> metrics,
                                                      net::ServiceManager& service, WatchHooks hooks,
                                                      const Clock& clock, const Logger& log) {
  auto implementation =
      std::make_shared<Implementation>(executor, std::move(metrics), service, std::move(hooks), clock);
  if (!metrics_at.empty()) {
    const bool has_scheme = metrics_at.starts_with("tcp:") || metrics_at.starts_with("unix:");
    auto endpoint = net::parse_endpoint(has_scheme ? metrics_at : "tcp:" + metrics_at);
    if (!endpoint) return make_error(endpoint.error().code, endpoint.error().message, "metrics");
    const auto alive = [raw = implementation.get()] { return raw->alive(); };
    const auto ready = [raw = implementation.get()]() -> Status {
      if (const Status living = raw->alive(); !living) return living;
      return raw->hooks.ready();
    };
    // The server goes before the implementation that its pages are of.
    auto server = net::MetricsServer::listen(executor, *endpoint, "handloft-modeld",
                                             [raw = implementation.get()] {
                                               return raw->stopped ? std::string()
                                                                   : raw->metrics->text(raw->hooks.figures());
                                             },
                                             log.component("metrics"), {alive, ready});
    if (!server) return make_error(server.error().code, server.error().message, "metrics");
    implementation->server = *std::move(server);
  }
  implementation->beat();
  return std::unique_ptr<ServeWatch>(new ServeWatch(std::move(implementation)));
}

std::optional<net::Endpoint> ServeWatch::metrics_endpoint() const {
  if (!implementation_->server) return std::nullopt;
  return implementation_->server->endpoint();
}

void ServeWatch::stop() {
  implementation_->stopped = true;
  implementation_->timer.cancel();
  if (implementation_->server) implementation_->server->stop();
}

StopDeadline::StopDeadline(Duration patience, Logger log)
    : thread_([this, patience, log = std::move(log)] {
        std::unique_lock lock(mutex_);
        if (over_.wait_for(lock, patience, [this] { return done_; })) return;
        log.error("the end takes longer than {} s: a disk hangs; what was answered as durable is safe",
                  std::chrono::duration_cast<std::chrono::seconds>(patience).count());
        std::_Exit(EXIT_FAILURE);
      }) {}

StopDeadline::~StopDeadline() {
  {
    const std::lock_guard lock(mutex_);
    done_ = true;
  }
  over_.notify_all();
  thread_.join();
}

}  // namespace handloft::session
