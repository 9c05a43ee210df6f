// handloft-hmd: shows a scene. See --help.

#include <cstdio>

#include "client-hmd/main/app.h"
#include "client-hmd/main/exit_status.h"

int main(int argc, char** argv) {
  using namespace handloft;
  const Result<client::ParsedOptions> parsed = client::parse_options(argc, argv);
  if (!parsed) {
    std::fprintf(stderr, "handloft-hmd: %s\n", parsed.error().describe().c_str());
    return client::exit_usage;
  }
  if (parsed->outcome.action == ParseOutcome::Action::show_text) {
    std::fputs(parsed->outcome.text.c_str(), stdout);
    return 0;
  }
  const Result<LogLevel> level = parse_log_level(parsed->options.log_level);
  const Logger log("hmd", level ? *level : LogLevel::info);
  const Status status = client::run_hmd(parsed->options, log);
  if (!status) log.error("{}", status.error().describe());
  return client::exit_status(status);
}
