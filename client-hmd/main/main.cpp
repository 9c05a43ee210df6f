// handloft-hmd: shows a scene. See --help.

#include <cstdio>

#include "client-hmd/main/app.h"

int main(int argc, char** argv) {
  using namespace handloft;
  constexpr int bad_usage = 2;
  const Result<client::ParsedOptions> parsed = client::parse_options(argc, argv);
  if (!parsed) {
    std::fprintf(stderr, "handloft-hmd: %s\n", parsed.error().describe().c_str());
    return bad_usage;
  }
  if (parsed->outcome.action == ParseOutcome::Action::show_text) {
    std::fputs(parsed->outcome.text.c_str(), stdout);
    return 0;
  }
  const Result<LogLevel> level = parse_log_level(parsed->options.log_level);
  const Logger log("hmd", level ? *level : LogLevel::info);
  if (const Status status = client::run_hmd(parsed->options, log); !status) {
    log.error("{}", status.error().describe());
    return 1;
  }
  return 0;
}
