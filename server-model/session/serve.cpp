#include "server-model/session/serve.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <csignal>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "common/base/version.h"
#include "common/base/wall_clock.h"
#include "common/net/message_client.h"
#include "common/net/service_manager.h"
#include "server-model/session/first_model.h"
#include "server-model/session/report.h"
#include "server-model/session/serve_watch.h"
#include "server-model/session/server.h"
#include "server-model/session/session_metrics.h"
#include "server-model/session/tracking_link.h"
#include "server-model/store/model_store.h"

namespace handloft::session {
namespace {

using namespace std::chrono_literals;

/// How long viewers get at the end of a recording to read what is left; a stalled one must not hold the
/// server.
constexpr auto flush_timeout = 5s;
constexpr auto poll_interval = 5ms;
/// Connections are closed within a second (Connection::close()).
constexpr auto close_timeout = 1500ms;
/// A start has room for a million clients of each endpoint (server.cpp has the endpoints above).
constexpr int epoch_shift = 20;

/// All of the end: closing connections, flushing the log. systemd kills after TimeoutStopSec=15.
constexpr auto stop_timeout = 10s;

/// `adopted`: systemd listens for us.
Result<std::vector<net::Endpoint>> endpoints_of(const ServeOptions& options, bool adopted) {
  std::vector<net::Endpoint> endpoints;
  for (const std::string& text : options.listen) {
    auto endpoint = net::parse_endpoint(text);
    if (!endpoint) return endpoint.error();
    endpoints.push_back(*std::move(endpoint));
  }
  if (endpoints.empty() && !adopted) {
    auto endpoint = net::default_model_endpoint();
    if (!endpoint) return endpoint.error();
    endpoints.push_back(*std::move(endpoint));
  }
  return endpoints;
}

/// Numbers of clients without a key must never come again in any file of the folder, whichever is opened: as
/// many a millisecond since 2026 as no server has.
std::uint64_t first_client_id_now() {
  constexpr std::int64_t begin_ms = 1'767'225'600'000;
  constexpr std::int64_t ns_per_ms = 1'000'000;
  constexpr unsigned clients_per_ms_shift = 8;
  const std::int64_t ms = std::max<std::int64_t>(0, wall_clock_ns() / ns_per_ms - begin_ms);
  return static_cast<std::uint64_t>(ms) << clients_per_ms_shift;
}

/// Who may come in.
Result<std::shared_ptr<access::Gate>> gate_of(const ServeOptions& options, const Logger& log) {
  auto gate_options = options.limits.gate_options();
  if (!gate_options) return gate_options.error();
  if (options.access.empty() && options.limits.local_users == "any")
    return make_error(ErrorCode::failed_precondition, "other users of this host need roles: --access FILE",
                      "people.local_users");
  if (options.access.empty()) return access::Gate::without_file(*std::move(gate_options));
  return access::Gate::open(options.access, *std::move(gate_options), log.component("access"));
}

std::string ready_line(const std::vector<net::Endpoint>& endpoints,
                       const std::optional<net::Endpoint>& metrics) {
  nlohmann::ordered_json line{{"ready", true}, {"endpoints", nlohmann::ordered_json::array()}};
  for (const net::Endpoint& endpoint : endpoints) line["endpoints"].push_back(endpoint.to_string());
  if (metrics) line["metrics"] = metrics->to_string();
  return line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

/// Runs the sockets until a signal or, when asked, the end of a recording.
class Session {
 public:
  Session(const ServeOptions& options, net::ServiceManager& service, const Clock& clock, const Logger& log)
      : options_(options), service_(service), clock_(clock), log_(log) {}

  Status run(const std::vector<net::Endpoint>& endpoints, std::vector<net::Listener> adopted,
             FirstModel served, std::ostream& out) {
    wait_for_reload();
    boost::asio::signal_set signals(context_, SIGINT, SIGTERM);
    signals.async_wait([this](const boost::system::error_code& error, int signal) {
      if (!error) {
        log_.info("stopping on signal {}", signal);
        begin_stop();
      }
    });
    ServerOptions server_options;
    server_options.net.program = program_version("handloft-modeld");
    options_.limits.apply_to(server_options);
    auto gate = gate_of(options_, log_);
    if (!gate) return gate.error();
    gate_ = *std::move(gate);
    server_options.gate = gate_;
    server_options.files = options_.files;
    for (const std::string& own : {options_.store, options_.models, options_.access, options_.report}) {
      if (!own.empty()) server_options.files.own.emplace_back(own);
    }
    server_options.actor.interaction = options_.interaction;
    server_options.actor.export_folder = options_.files.write_folder;
    server_options.actor.cad = options_.files.cad;
    if (!options_.export_folder.empty()) server_options.actor.export_folder = options_.export_folder;
    server_options.actor.acknowledge = options_.acknowledge;
    server_options.model_name = served.name;
    server_options.nameless = served.nameless;
    if (!options_.models.empty()) {
      server_options.rooms.folder = options_.models;
      server_options.rooms.create = options_.create;
      server_options.rooms.close_after = options_.close_after;
      server_options.rooms.open = [this](const std::filesystem::path& path) {
        return open_model(path, path.stem().string(), log_);
      };
      server_options.net.first_client_id += first_client_id_now();
    } else if (served.store) {
      // Ids of the log's clients never come again, or a new client would get an old one's answers.
      server_options.net.first_client_id += served.store->epoch() << epoch_shift;
    }
    server_options.actor.metrics = metrics_;
    server_options.actor.store = std::move(served.store);
    server_options.actor.epoch = static_cast<std::uint64_t>(to_ns(clock_.now()));
    auto server = Server::start(
        context_.get_executor(), endpoints, std::move(served.model), std::move(server_options), clock_, log_,
        [this] { on_end_of_recording(); }, std::move(adopted));
    if (!server) return server.error();
    server_ = *std::move(server);
    if (!options_.tracking.empty()) {
      auto endpoint = net::parse_endpoint(options_.tracking);
      if (!endpoint) return make_error(endpoint.error().code, endpoint.error().message, "tracking");
      tracking_ =
          std::make_unique<TrackingLink>(*endpoint, server_->actor(), clock_, log_.component("tracking"));
    }
    WatchHooks hooks;
    hooks.models = [this] { return watched_models(); };
    hooks.figures = [this] { return present_figures(); };
    hooks.ready = [this] { return ready(); };
    auto watch = ServeWatch::start(context_.get_executor(), options_.metrics, metrics_, service_,
                                   std::move(hooks), clock_, log_);
    if (!watch) return watch.error();
    watch_ = *std::move(watch);
    out << ready_line(server_->endpoints(), watch_->metrics_endpoint()) << std::endl;
    service_.ready(serving());
    context_.run();  // ends when connections are closed and timers are done
    return write_report();
  }

 private:
  PresentFigures present_figures() const {
    PresentFigures present;
    present.clients = server_->clients();
    present.clients_served = server_->clients_served();
    present.models = server_->models();
    present.packs = server_->packs();
    return present;
  }

  std::string serving() const {
    if (!options_.models.empty()) return "Serving the models in " + options_.models;
    return "Serving " + (options_.store.empty() ? "a model" : options_.store);
  }

  std::vector<WatchedModel> watched_models() const {
    std::vector<WatchedModel> watched;
    for (const RoomPtr& room : server_->open_rooms()) {
      WatchedModel model;
      model.name = room->name;
      model.held = room;
      model.ask = [weak = std::weak_ptr(room)](std::function<void()> answered) {
        // A question without a body: refused at once, in its turn.
        if (const RoomPtr open = weak.lock())
          open->actor->ask({}, [answered = std::move(answered)](const auto&) { answered(); });
      };
      if (room->store) model.kept = [store = room->store] { return store->failure(); };
      watched.push_back(std::move(model));
    }
    return watched;
  }

  Status ready() const {
    if (stopping_) return make_error(ErrorCode::cancelled, "the server stops");
    return {};
  }

  void reload() {
    const auto read = options_.reload();
    auto gate_options = read ? read->limits.gate_options() : Result<access::GateOptions>(read.error());
    if (!gate_options) {
      log_.error("the configuration stays as it was: {}", gate_options.error().describe());
      return;
    }
    log_.set_level(read->log_level);
    ServerOptions limits;
    read->limits.apply_to(limits);
    server_->set_limits(limits);
    gate_->set_options(*gate_options);
    log_.info(
        "the configuration was read again; changed: {}; with the next start: {}",
        read->changed.empty() ? "nothing" : fmt::format("{}", fmt::join(read->changed, ", ")),
        read->needs_restart.empty() ? "nothing" : fmt::format("{}", fmt::join(read->needs_restart, ", ")));
  }

  void wait_for_reload() {
    hangups_.async_wait([this](const boost::system::error_code& error, int) {
      if (error) return;
      service_.reloading("Reading the configuration again");
      if (options_.reload && server_ && !stopping_) reload();
      service_.ready(serving());
      wait_for_reload();
    });
  }

  void on_end_of_recording() {
    log_.info("the recording has ended");
    if (options_.at_end != ServeOptions::AtEnd::exit) return;
    boost::asio::post(context_, [this] {
      flush_until_ = clock_.now() + flush_timeout;
      stop_when_flushed();
    });
  }

  void stop_when_flushed() {
    if (stopping_) return;
    const bool flushed = server_->actor().idle() && server_->flushed();
    if (flushed || clock_.now() > flush_until_) {
      if (!flushed) log_.warning("a viewer has not read all within {} s", flush_timeout.count());
      begin_stop();
      return;
    }
    timer_.expires_after(poll_interval);
    timer_.async_wait([this](const boost::system::error_code& error) {
      if (!error) stop_when_flushed();
    });
  }

  void begin_stop() {
    if (stopping_) return;
    stopping_ = true;
    service_.stopping();
    deadline_.emplace(stop_timeout, log_);
    watch_->stop();
    hangups_.cancel();
    // Ends gestures in the air as a gone daemon would; what a hand has laid is not lost by stopping.
    server_->actor().end_gestures();
    figures_.state = server_->actor().state();
    figures_.clients_served = server_->clients_served();
    figures_.capture_to_delta = server_->capture_to_delta();
    // What waits for the disk is answered before its client is told good-bye.
    server_->flush();
    for (const WatchedModel& model : watched_models()) {
      const Status kept = model.kept ? model.kept() : Status();
      if (kept) continue;
      log_.with("model", model.name).error("ends without its last operations: {}", kept.error().message);
      unkept_ =
          make_error(kept.error().code,
                     fmt::format("the model \"{}\" ends without its last operations", model.name), "store");
    }
    server_->stop();
    tracking_.reset();
    close_until_ = clock_.now() + close_timeout;
    end_when_closed();
  }

  void end_when_closed() {
    if (server_->peer_count() == 0 || clock_.now() > close_until_) {
      context_.stop();
      return;
    }
    timer_.expires_after(poll_interval);
    timer_.async_wait([this](const boost::system::error_code&) { end_when_closed(); });
  }

  Status write_report() {
    watch_.reset();
    server_.reset();
    if (options_.report.empty()) return unkept_;
    Status written = session::write_report(options_.report, figures_);
    return unkept_ ? std::move(written) : unkept_;
  }

  const ServeOptions& options_;
  net::ServiceManager& service_;
  const Clock& clock_;
  Logger log_;
  std::optional<StopDeadline> deadline_;  ///< Of all that follows.
  std::shared_ptr<SessionMetrics> metrics_ = std::make_shared<SessionMetrics>();
  std::shared_ptr<access::Gate> gate_;
  boost::asio::io_context context_;
  boost::asio::signal_set hangups_{context_, SIGHUP};
  boost::asio::steady_timer timer_{context_};
  std::unique_ptr<Server> server_;
  std::unique_ptr<ServeWatch> watch_;
  std::unique_ptr<TrackingLink> tracking_;
  TimePoint flush_until_;
  TimePoint close_until_;
  bool stopping_ = false;
  Status unkept_;  ///< That a disk failed.
  SessionFigures figures_;
};

}  // namespace

namespace {

/// What only another configuration mends: to start again, as service managers do, does not.
bool is_of_configuration(const Error& error) {
  switch (error.code) {
    case ErrorCode::invalid_argument:
      return true;
    case ErrorCode::failed_precondition:
      return error.field == "listen" || error.field == "people.local_users";
    case ErrorCode::permission_denied:
      return error.field == "endpoint" || error.field == "metrics";
    default:
      return false;
  }
}

}  // namespace

int serve(const ServeOptions& options, std::ostream& out) {
  const Logger log("modeld", options.log_level, options.log_format);
  const auto fail = [&](const Error& error) {
    log.error("{}", error.describe());
    return is_of_configuration(error) ? 2 : 1;
  };
  const SystemClock clock;
  net::ServiceManager service(clock);
  auto adopted = service.take_listeners();
  if (!adopted) return fail(adopted.error());
  auto endpoints = endpoints_of(options, !adopted->empty());
  if (!endpoints) return fail(endpoints.error());
  Session session(options, service, clock, log);
  auto served = first_model(options, log);
  if (!served) return fail(served.error());
  if (const Status done = session.run(*endpoints, *std::move(adopted), *std::move(served), out); !done)
    return fail(done.error());
  return 0;
}

}  // namespace handloft::session
