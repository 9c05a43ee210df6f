#pragma once
// The running daemon: samples in, published frames out (live_session.h, fast_session.h), for as long as it is
// told to. Sockets, recording and metrics outlive the sessions, so that reading configuration and calibration
// again (SIGHUP) costs no subscriber its connection.
//
// A recording is written in the order in which the fusion consumed, so that a replay, which is one thread
// from end to end, gives the same bits (T13). No thread waits for a subscriber, but for a replay's.

#include <functional>
#include <optional>

#include "common/base/clock.h"
#include "common/base/log.h"
#include "common/base/result.h"
#include "common/net/endpoint.h"
#include "common/net/service_manager.h"
#include "daemon-tracking/main/options.h"
#include "daemon-tracking/main/report.h"
#include "daemon-tracking/main/session_control.h"

namespace handloft::tracking {

/// A session that came to its end.
struct Session {
  SessionFigures figures;  ///< Since the start, or since the last time that files were read again.
  /// What went wrong on the way without ending it: the new recording could not be written to its end, or the
  /// replayed one is damaged.
  std::optional<Error> problem;
};

/// What the daemon has of the world outside; all may be left out.
struct DaemonWorld {
  net::ServiceManager* service = nullptr;
  std::optional<net::Listener> listener;  ///< Instead of one at DaemonOptions::listen.
  /// The options as they now stand in file and command line, for SessionControl::reload().
  std::function<Result<DaemonOptions>()> read_options;
};

/// What may not change while it runs, by its field; empty: nothing has. Sockets, recordings and ways of
/// running stay as they are until the next start.
std::string fixed_option_that_differs(const DaemonOptions& running, const DaemonOptions& wanted);

/// Runs until the source ends (with exit_at_end) or a stop is requested. Errors only where it can't start.
Result<Session> run_daemon(const DaemonOptions& options, const Clock& clock, const Logger& log,
                           SessionControl& control, DaemonWorld world = {});

}  // namespace handloft::tracking
