#pragma once
// The figures of a run that goes on, for Prometheus (--metrics): the frame loop leaves them now and then,
// whoever asks gets the newest. The loop waits for nobody (V5).

#include <memory>
#include <mutex>
#include <string>

#include "client-hmd/main/report.h"
#include "common/base/log.h"
#include "common/net/endpoint.h"
#include "common/net/io_thread.h"
#include "common/net/metrics_server.h"

namespace handloft::client {

/// Durations as summaries in seconds: frames, how old what is seen is (photon_figures.h), the model's way;
/// the rest as counters and gauges.
std::string prometheus_text(const RunFigures& figures);

class Metrics {
 public:
  /// Errors: as net::MetricsServer::listen().
  static Result<std::unique_ptr<Metrics>> serve(const net::Endpoint& endpoint, Logger log);
  ~Metrics();
  Metrics(const Metrics&) = delete;
  Metrics& operator=(const Metrics&) = delete;

  void put(const RunFigures& figures);
  const net::Endpoint& endpoint() const { return server_->endpoint(); }

 private:
  Metrics() = default;

  std::mutex mutex_;
  std::string text_;  ///< Made by put(): a scene is not kept for whoever asks once an hour.
  net::IoThread io_;
  std::unique_ptr<net::MetricsServer> server_;
};

}  // namespace handloft::client
