#pragma once
// `handloft-modeld serve`: one model behind its sockets until SIGTERM, SIGINT or the end of a recording.

#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

#include "common/base/log.h"
#include "server-model/interaction/interaction.h"
#include "server-model/session/model_actor.h"
#include "server-model/session/resolve_operation.h"
#include "server-model/session/rooms.h"
#include "server-model/session/service_limits.h"

namespace handloft::session {

/// A configuration that was read again while the server runs.
struct Reloaded {
  LogLevel log_level = LogLevel::info;
  ServiceLimits limits;                    ///< Of which those count that ServiceLimits::holds_at_once() says.
  std::vector<std::string> changed;        ///< "--limits-max-connections: 256 before, 32 now"
  std::vector<std::string> needs_restart;  ///< The same of what holds with the next start.
};

struct ServeOptions {
  enum class AtEnd { stay, exit };

  std::vector<std::string>
      listen;  ///< "unix:PATH", "tcp:HOST:PORT", "tls:HOST:PORT"; empty: the user's default model socket.
  std::string tracking;  ///< Endpoint of handloft-trackd; empty: no hand.
  std::string
      access;  ///< The access file (access/access_file.h), made when missing; empty: no users but this one.
  ServiceLimits limits;
  std::string script;  ///< Run before anybody is served; a failing line ends the server.
  std::string store;   ///< The model's file (store/model_store.h), made when missing; empty: none.
  std::string
      models;  ///< A folder of such files, a model each (rooms.h), in place of `store`; empty: one model.
  RoomsOptions::Create create = RoomsOptions::Create::owners;  ///< With `models`: who may make further ones.
  Duration close_after = std::chrono::minutes(5);  ///< With `models`: that nobody uses for so long.
  ActorOptions::Acknowledge acknowledge = ActorOptions::Acknowledge::durable;
  std::string report;  ///< JSON file written at the end (report.h); empty: none.
  AtEnd at_end =
      AtEnd::stay;          ///< Exit after the tracking daemon's recording has ended and viewers have it all.
  model::FileAccess files;  ///< For operations of unix: peers; tcp: peers stay within its folders.
  std::string export_folder;  ///< Where the palette's "Export" writes; empty: files.write_folder.
  interaction::InteractionOptions interaction;
  LogLevel log_level = LogLevel::info;
  LogFormat log_format = LogFormat::text;
  std::string metrics;  ///< Where metrics and health are served (serve_watch.h); empty: nowhere.
  /// SIGHUP: reads the configuration anew; an error changes nothing. Empty: nothing is read.
  std::function<Result<Reloaded>()> reload;
};

/// Prints one line of JSON on `out` when ready:
/// {"ready":true,"endpoints":["unix:...","tcp:127.0.0.1:41234"]}, with "metrics" where they are served, and
/// tells systemd, whose sockets it takes besides or instead of its own. Blocks SIGTERM, SIGINT and SIGHUP, so
/// call it before there are other threads. Returns the exit status: 0 stopped on request or at the end of a
/// recording; 1 an error, told on standard error; 2 one of the configuration.
int serve(const ServeOptions& options, std::ostream& out);

}  // namespace handloft::session
