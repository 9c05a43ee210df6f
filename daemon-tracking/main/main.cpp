// handloft-trackd: see --help, and daemon-tracking/README.md for where to start reading.

#include <csignal>
#include <cstdio>

#include "daemon-tracking/main/daemon.h"
#include "daemon-tracking/main/devices_command.h"
#include "daemon-tracking/main/doctor_command.h"
#include "daemon-tracking/main/exit_status.h"
#include "daemon-tracking/main/signal_thread.h"
#include "daemon-tracking/main/status_command.h"

namespace {

using namespace handloft;

int fail(const Error& error) {
  std::fprintf(stderr, "handloft-trackd: %s\n", error.describe().c_str());
  return error.code == ErrorCode::invalid_argument ? tracking::exit_usage : tracking::exit_failed;
}

// The options of file and command line as they now are.
struct ReadOptions {
  tracking::DaemonOptions options;
  ParseOutcome outcome;
};
Result<ReadOptions> read_options(int argc, const char* const* argv) {
  ReadOptions read;
  OptionTable table = tracking::make_option_table(read.options);
  Result<ParseOutcome> parsed = table.parse(argc, argv);
  if (!parsed) return parsed.error();
  read.outcome = std::move(*parsed);
  if (read.outcome.action == ParseOutcome::Action::show_text) return read;
  if (const Status resolved = tracking::resolve_command(read.options); !resolved) return resolved.error();
  if (const Status good = tracking::check(read.options); !good) return good.error();
  return read;
}

int run(const tracking::DaemonOptions& options, const Clock& clock, int argc, const char* const* argv) {
  const Result<LogLevel> level = parse_log_level(options.log_level);
  if (!level) return fail(level.error());
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);  // A recording at the limit of file sizes is an error of that file only.

  tracking::SessionControl control;
  const tracking::SignalThread signals(control);
  if (!signals.status()) return fail(signals.status().error());
  const Logger log("trackd", *level);
  net::ServiceManager service(clock);
  tracking::DaemonWorld world;
  world.service = &service;
  Result<std::optional<net::Listener>> listener = service.take_listener();
  if (!listener) return fail(listener.error());
  world.listener = std::move(*listener);
  world.read_options = [argc, argv]() -> Result<tracking::DaemonOptions> {
    Result<ReadOptions> read = read_options(argc, argv);
    if (!read) return read.error();
    return std::move(read->options);
  };
  const auto session = tracking::run_daemon(options, clock, log, control, std::move(world));
  if (!session) return fail(session.error());
  if (options.report) {
    if (const Status written = tracking::write_report(session->figures, *options.report); !written)
      return fail(written.error());
  }
  return session->problem ? fail(*session->problem) : tracking::exit_ok;
}

}  // namespace

int main(int argc, char** argv) {
  const Result<ReadOptions> read = read_options(argc, argv);
  if (!read) return fail(read.error());
  if (read->outcome.action == ParseOutcome::Action::show_text) {
    std::fputs(read->outcome.text.c_str(), stdout);
    return tracking::exit_ok;
  }
  const SystemClock clock;
  if (read->options.command == "devices") return tracking::run_devices(read->options);
  if (read->options.command == "status") return tracking::run_status(read->options, clock);
  if (read->options.command == "doctor") return tracking::run_doctor(read->options, clock);
  return run(read->options, clock, argc, argv);
}
