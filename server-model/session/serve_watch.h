#pragma once
// What watches a running server from outside (issue 7, part 6): its metrics and health over HTTP, the word to
// systemd that the models' threads are alive, and an end that comes in time even when a disk hangs.

#include <boost/asio/any_io_executor.hpp>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "common/base/clock.h"
#include "common/base/log.h"
#include "common/base/result.h"
#include "common/net/endpoint.h"
#include "common/net/service_manager.h"
#include "server-model/session/session_metrics.h"

namespace handloft::session {

/// One that is served now.
struct WatchedModel {
  std::string name;
  /// Watched as long as this lives, also when it is no longer named: a model that is being closed may hang,
  /// too.
  std::weak_ptr<const void> held;
  /// Calls back from the model's thread, in its turn. Must not keep the model alive.
  std::function<void(std::function<void()> answered)> ask;
  std::function<Status()> kept;  ///< Why nothing can be kept any more; empty: nothing is to be.
};

/// All on the executor.
struct WatchHooks {
  std::function<std::vector<WatchedModel>()> models;
  std::function<PresentFigures()> figures;
  std::function<Status()> ready;  ///< Of the server beside its models.
};

class ServeWatch {
 public:
  /// `metrics_at`: "tcp:127.0.0.1:9464", "127.0.0.1:9464", "unix:PATH"; empty: nothing is served. Everything
  /// given must outlive it, and `executor` run on one thread. Errors: those of net::MetricsServer::listen
  /// (field "metrics").
  static Result<std::unique_ptr<ServeWatch>> start(const boost::asio::any_io_executor& executor,
                                                   const std::string& metrics_at,
                                                   std::shared_ptr<SessionMetrics> metrics,
                                                   net::ServiceManager& service, WatchHooks hooks,
                                                   const Clock& clock, const Logger& log);
  ~ServeWatch();
  ServeWatch(const ServeWatch&) = delete;
  ServeWatch& operator=(const ServeWatch&) = delete;

  std::optional<net::Endpoint> metrics_endpoint() const;
  /// All models' threads have answered within 30 s; else which has not (field "model").
  Status alive() const;
  /// Alive, and every model can be kept; else which cannot and why.
  Status ready() const;
  /// Asks all models for a sign of life: done once a second by itself.
  void look();
  /// Asks nothing and nobody any more.
  void stop();

 private:
  struct Implementation;
  explicit ServeWatch(std::shared_ptr<Implementation> implementation);
  std::shared_ptr<Implementation> implementation_;
};

/// Ends the process with status 1 when it lives so long: a disk that hangs must not hold a service that is
/// told to end.
class StopDeadline {
 public:
  StopDeadline(Duration patience, Logger log);
  ~StopDeadline();
  StopDeadline(const StopDeadline&) = delete;
  StopDeadline& operator=(const StopDeadline&) = delete;

 private:
  std::mutex mutex_;
  std::condition_variable over_;
  bool done_ = false;
  std::thread thread_;
};

}  // namespace handloft::session
