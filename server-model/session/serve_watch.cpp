#include "server-model/session/serve_watch.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <cstdlib>
#include <utility>

#include "common/base/process_figures.h"
#include "common/net/metrics_server.h"

namespace handloft::session {

namespace {

using namespace std::chrono_literals;

constexpr std::chrono::milliseconds beat_every = 1s;
/// The largest of what one operation may take: a solve of a large surface on a loaded computer.
constexpr Duration alive_within = 30s;
constexpr Duration memory_looked_at_every = 60s;

}  // namespace

struct ServeWatch::Implementation : std::enable_shared_from_this<ServeWatch::Implementation> {
  Implementation(const boost::asio::any_io_executor& executor, std::shared_ptr<SessionMetrics> counted,
                 net::ServiceManager& manager, WatchHooks asked, const Clock& used, Logger its_log)
      : timer(executor),
        metrics(std::move(counted)),
        service(manager),
        hooks(std::move(asked)),
        clock(used),
        log(std::move(its_log)) {}

  void beat() {
    if (stopped) return;
    look();
    const auto interval = service.watchdog_interval();
    timer.expires_after(interval ? std::min(*interval, beat_every) : beat_every);
    timer.async_wait([weak = weak_from_this()](const boost::system::error_code& error) {
      const auto self = weak.lock();
      if (self && !error) self->beat();
    });
  }

  /// Models are opened and closed at any time.
  void refresh() {
    std::erase_if(watched, [](const Watched& each) { return each.model.held.expired(); });
    for (WatchedModel& model : hooks.models()) {
      const auto known = std::find_if(watched.begin(), watched.end(), [&](const Watched& each) {
        return !each.model.held.owner_before(model.held) && !model.held.owner_before(each.model.held);
      });
      if (known != watched.end()) continue;
      auto life = std::make_shared<Life>();
      life->answered_ns = to_ns(clock.now());
      watched.push_back({std::move(model), std::move(life), false});
    }
  }

  /// Asks every model, and tells systemd when all have answered since it was told last.
  void look() {
    refresh();
    std::int64_t oldest = to_ns(clock.now());
    for (Watched& each : watched) {
      oldest = std::min(oldest, each.life->answered_ns.load());
      const Status living = alive(each);
      if (!living && !each.told) log.with("model", each.model.name).error("{}", living.error().message);
      each.told = !living;
      // Those who work on it are told with their next operation; who looks after the server only here.
      const Status saved = kept(each);
      if (!saved && !each.told_unkept)
        log.with("model", each.model.name)
            .error("takes no more operations, and the last ones are not saved: {}", saved.error().message);
      each.told_unkept = !saved;
      if (each.life->waiting.exchange(true)) continue;
      each.model.ask([life = each.life, &time = clock] {
        life->answered_ns = to_ns(time.now());
        life->waiting = false;
      });
    }
    return_memory();
    if (oldest <= told_ns) return;
    told_ns = oldest;
    service.alive();
  }

  void return_memory() {
    if (clock.now() - memory_looked_at < memory_looked_at_every) return;
    memory_looked_at = clock.now();
    const TimePoint begin = clock.now();
    if (const std::uint64_t bytes = memory.look(); bytes > 0)
      log.debug("gave {} KiB of memory back in {:.1f} ms", bytes >> 10U,
                1e3 * to_seconds(clock.now() - begin));
  }

  struct Life {
    std::atomic<std::int64_t> answered_ns{0};
    std::atomic<bool> waiting = false;
  };
  struct Watched {
    WatchedModel model;
    std::shared_ptr<Life> life;
    bool told = false;         ///< That it hangs.
    bool told_unkept = false;  ///< That its disk fails.
  };

  static Status kept(const Watched& each) {
    return each.model.kept && !each.model.held.expired() ? each.model.kept() : Status();
  }

  Duration silence_of(const Watched& each) const { return clock.now() - from_ns(each.life->answered_ns); }

  Status alive(const Watched& each) const {
    const Duration silence = silence_of(each);
    if (silence <= alive_within || each.model.held.expired()) return {};
    return make_error(ErrorCode::timeout,
                      fmt::format("the thread of the model \"{}\" has not answered for {} s", each.model.name,
                                  std::chrono::duration_cast<std::chrono::seconds>(silence).count()),
                      "model");
  }

  /// The first thing that is wrong, and how many more are.
  template <typename Check>
  Status all(const Check& check) const {
    Status first;
    std::size_t more = 0;
    for (const Watched& each : watched) {
      Status status = check(each);
      if (status) continue;
      if (first) {
        first = std::move(status);
      } else {
        ++more;
      }
    }
    if (first || more == 0) return first;
    return make_error(first.error().code, fmt::format("{} (and {} more)", first.error().message, more),
                      first.error().field);
  }

  Status alive() {
    refresh();
    return all([this](const Watched& each) { return alive(each); });
  }

  Status ready() {
    refresh();
    if (Status server_is = hooks.ready ? hooks.ready() : Status(); !server_is) return server_is;
    return all([this](const Watched& each) -> Status {
      if (Status living = alive(each); !living) return living;
      const Status saved = kept(each);
      if (saved) return {};
      return make_error(saved.error().code,
                        fmt::format("the model \"{}\": {}", each.model.name, saved.error().message), "model");
    });
  }

  std::string text() {
    refresh();
    PresentFigures figures = hooks.figures();
    for (ModelFigures& model : figures.models) {
      for (const Watched& each : watched) {
        if (each.model.name == model.name && !each.model.held.expired())
          model.silence_s = std::chrono::duration<double>(silence_of(each)).count();
      }
    }
    return metrics->text(figures);
  }

  boost::asio::steady_timer timer;
  std::shared_ptr<SessionMetrics> metrics;
  net::ServiceManager& service;
  WatchHooks hooks;
  const Clock& clock;
  Logger log;
  std::unique_ptr<net::MetricsServer> server;
  std::vector<Watched> watched;
  MemoryReturn memory;
  TimePoint memory_looked_at;
  std::int64_t told_ns = 0;  ///< Since when all models had answered when systemd was told last.
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
      std::make_shared<Implementation>(executor, std::move(metrics), service, std::move(hooks), clock, log);
  if (!metrics_at.empty()) {
    const bool has_scheme = metrics_at.starts_with("tcp:") || metrics_at.starts_with("unix:");
    auto endpoint = net::parse_endpoint(has_scheme ? metrics_at : "tcp:" + metrics_at);
    if (!endpoint) return make_error(endpoint.error().code, endpoint.error().message, "metrics");
    const auto alive = [raw = implementation.get()] { return raw->alive(); };
    const auto ready = [raw = implementation.get()] { return raw->ready(); };
    // The server goes before the implementation that its pages are of.
    auto server = net::MetricsServer::listen(
        executor, *endpoint, "handloft-modeld",
        [raw = implementation.get()] { return raw->stopped ? std::string() : raw->text(); },
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

Status ServeWatch::alive() const {
  return implementation_->alive();
}

Status ServeWatch::ready() const {
  return implementation_->ready();
}

void ServeWatch::look() {
  implementation_->look();
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
