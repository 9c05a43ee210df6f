// handloft-trackd: see --help, and daemon-tracking/README.md for where to start reading.

#include <atomic>
#include <csignal>
#include <cstdio>

#include "daemon-tracking/main/daemon.h"
#include "daemon-tracking/main/exit_status.h"

namespace {

std::atomic<bool> stop_signalled{false};
void on_signal(int) {
  stop_signalled.store(true);
}

int fail(const handloft::Error& error) {
  std::fprintf(stderr, "handloft-trackd: %s\n", error.describe().c_str());
  return error.code == handloft::ErrorCode::invalid_argument ? handloft::tracking::exit_usage
                                                             : handloft::tracking::exit_failed;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace handloft;
  tracking::DaemonOptions options;
  OptionTable table = tracking::make_option_table(options);
  const Result<ParseOutcome> parsed = table.parse(argc, argv);
  if (!parsed) return fail(parsed.error());
  if (parsed->action == ParseOutcome::Action::show_text) {
    std::fputs(parsed->text.c_str(), stdout);
    return tracking::exit_ok;
  }
  if (const Status good = tracking::check(options); !good) return fail(good.error());
  const Result<LogLevel> level = parse_log_level(options.log_level);
  if (!level) return fail(level.error());

  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);  // A recording at the limit of file sizes is an error of that file only.

  const SystemClock clock;
  const Logger log("trackd", *level);
  const auto session = tracking::run_daemon(options, clock, log, [] { return stop_signalled.load(); });
  if (!session) return fail(session.error());
  if (options.report) {
    if (const Status written = tracking::write_report(session->figures, *options.report); !written)
      return fail(written.error());
  }
  return session->problem ? fail(*session->problem) : tracking::exit_ok;
}
