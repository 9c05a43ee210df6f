#pragma once
// Serves a program's metrics over HTTP on loopback or on a Unix socket of ours: GET /metrics, /healthz (is it
// alive?) and /readyz (can it be worked with?), one answer a connection. Off by default; nothing else can be
// asked of it, and it tells nothing of what hands do.

#include <boost/asio/any_io_executor.hpp>
#include <functional>
#include <memory>
#include <string>

#include "common/base/log.h"
#include "common/base/result.h"
#include "common/net/endpoint.h"

namespace handloft::net {

/// Asked from the executor's threads; an error is answered with 503 and its words. Empty: always well.
struct HealthChecks {
  std::function<Status()> alive;
  std::function<Status()> ready;
};

class MetricsServer {
 public:
  /// `program`: its name, for the answers' heads. `text` is asked from the executor's threads. Errors: those
  /// of listen_on (TCP beyond loopback is refused).
  static Result<std::unique_ptr<MetricsServer>> listen(const boost::asio::any_io_executor& executor,
                                                       const Endpoint& endpoint, std::string program,
                                                       std::function<std::string()> text, Logger log,
                                                       HealthChecks health = {});
  ~MetricsServer();
  MetricsServer(const MetricsServer&) = delete;
  MetricsServer& operator=(const MetricsServer&) = delete;

  const Endpoint& endpoint() const;  ///< With the port that the system chose.
  void stop();

 private:
  struct Implementation;
  explicit MetricsServer(std::shared_ptr<Implementation> implementation);
  std::shared_ptr<Implementation> implementation_;
};

}  // namespace handloft::net
