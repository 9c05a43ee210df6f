#include "server-model/main/serve_command.h"

#include <cstdio>
#include <iostream>
#include <memory>

#include "common/base/config.h"
#include "common/base/log.h"
#include "server-model/main/exit_status.h"
#include "server-model/session/cad_process.h"
#include "server-model/session/serve.h"

namespace handloft::model {

namespace {

constexpr const char* description =
    "Serves one model to viewers and editors, and lets the hand that handloft-trackd follows shape it. "
    "Prints "
    "one line of JSON with its endpoints when it is ready. Stops on SIGTERM or SIGINT, and with --at-end "
    "exit "
    "after a recording. Exit status: 0 stopped on request or at the end of a recording, 1 an error, 2 wrong "
    "usage.";

}  // namespace

int serve_command(const std::vector<std::string>& arguments) {
  session::ServeOptions options;
  std::string at_end = "stay";
  std::string acknowledge = "durable";
  std::string create = "owners";
  constexpr double longest_s = 86'400;
  double close_after_s = to_seconds(options.close_after);
  std::string log_level = "info";
  std::string log_format = "text";
  std::string read_folder = ".";
  std::string write_folder = ".";
  OptionTable table("handloft-modeld serve", description);
  table.add("listen", options.listen,
            "Where viewers and editors connect; may be repeated; none: your own model socket",
            TextRule{.choices = {}, .value_name = "ENDPOINT"});
  table.add("tracking", options.tracking, "Where handloft-trackd publishes; none: no hand",
            TextRule{.choices = {}, .value_name = "ENDPOINT"});
  table.add("store", options.store,
            "The model's file, made when missing: every operation is kept there; none: nothing is kept",
            TextRule{.choices = {}, .value_name = "FILE"});
  table.add("models", options.models,
            "A folder of such files, in place of --store: a model each, opened when somebody joins it",
            TextRule{.choices = {}, .value_name = "FOLDER"});
  table.add("create", create, "With --models: who may make one by joining a name that is not there",
            TextRule{.choices = {"owners", "nobody"}, .value_name = ""});
  table.add("close_after", close_after_s,
            "With --models: one that nobody uses is closed after so many seconds", NumberRange{0, longest_s});
  table.add("access", options.access,
            "The file of users, devices and roles, made when missing; tls: endpoints need it; none: no users "
            "but you",
            TextRule{.choices = {}, .value_name = "FILE"});
  table.add("acknowledge", acknowledge,
            "With a store: when an editor's operation is answered, once it is on the disk or at once",
            TextRule{.choices = {"durable", "applied"}, .value_name = ""});
  table.add("script", options.script,
            "Script to run before anybody is served; not on a store that has operations",
            TextRule{.choices = {}, .value_name = "FILE"});
  table.add("report", options.report, "JSON report to write at the end",
            TextRule{.choices = {}, .value_name = "FILE"});
  table.add(
      "at_end", at_end,
      "When the tracked recording has ended: stay, or exit once every viewer has read all (5 s at most)",
      TextRule{.choices = {"stay", "exit"}, .value_name = ""});
  table.add("read_folder", read_folder, "Where relative paths of imports start; tcp: peers cannot leave it",
            TextRule{.choices = {}, .value_name = "DIR"});
  table.add("write_folder", write_folder, "Where relative paths of exports start; tcp: peers cannot leave it",
            TextRule{.choices = {}, .value_name = "DIR"});
  table.add("export_folder", options.export_folder,
            "Where \"Export\" on the hand's palette writes; none: the write folder",
            TextRule{.choices = {}, .value_name = "DIR"});
  options.limits.add_to(table);
  table.add("log_level", log_level, "What is logged on standard error",
            TextRule{.choices = {"trace", "debug", "info", "warning", "error", "off"}, .value_name = ""});
  table.add("log_format", log_format,
            "How: lines for people, or JSON objects with component, model and client",
            TextRule{.choices = {"text", "json"}, .value_name = ""});
  table.add("metrics", options.metrics,
            "Serve metrics in Prometheus' text format and health: 127.0.0.1:9464 or unix:PATH, GET /metrics, "
            "/healthz, /readyz; none: nothing",
            TextRule{.choices = {}, .value_name = "ENDPOINT"});
  auto outcome = table.parse(arguments);
  if (!outcome) {
    std::fprintf(stderr, "handloft-modeld serve: %s\n", outcome.error().describe().c_str());
    return exit_usage;
  }
  if (outcome->action == ParseOutcome::Action::show_text) {
    std::fputs(outcome->text.c_str(), stdout);
    return exit_ok;
  }
  const auto level = parse_log_level(log_level);
  if (!level) {
    std::fprintf(stderr, "handloft-modeld serve: %s\n", level.error().describe().c_str());
    return exit_usage;
  }
  options.log_level = *level;
  options.log_format = log_format == "json" ? LogFormat::json : LogFormat::text;
  options.reload = [&table, &arguments, &log_level]() -> Result<LogLevel> {
    // What else it sets was looked at when the server started, and is not again.
    if (auto again = table.parse(arguments); !again) return again.error();
    return parse_log_level(log_level);
  };
  options.acknowledge = acknowledge == "applied" ? session::ActorOptions::Acknowledge::applied
                                                 : session::ActorOptions::Acknowledge::durable;
  options.create =
      create == "nobody" ? session::RoomsOptions::Create::nobody : session::RoomsOptions::Create::owners;
  options.close_after = from_seconds(close_after_s);
  options.at_end = at_end == "exit" ? session::ServeOptions::AtEnd::exit : session::ServeOptions::AtEnd::stay;
  options.files.read_folder = read_folder;
  options.files.write_folder = write_folder;
  options.files.cad = std::make_shared<const session::CadProcess>();
  return session::serve(options, std::cout);
}

}  // namespace handloft::model
