#include "server-model/main/serve_command.h"

#include <fmt/format.h>

#include <cstdio>
#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/base/config.h"
#include "common/base/log.h"
#include "common/base/process_figures.h"
#include "server-model/main/exit_status.h"
#include "server-model/session/cad_process.h"
#include "server-model/session/serve.h"

namespace handloft::model {

namespace {

constexpr const char* description =
    "Serves a model, or those of a folder, to viewers and editors, and lets the hand that handloft-trackd "
    "follows shape the first one. Prints one line of JSON with its endpoints when it is ready. Stops on "
    "SIGTERM or SIGINT, and with --at-end exit after a recording. On SIGHUP it reads its configuration "
    "again: "
    "the log level, limits and people's settings hold at once, for a client's own limits from its next "
    "connection on; the log tells what has changed and what waits for the next start, and of a file with a "
    "mistake which field is wrong, and then nothing changes. Exit status: 0 stopped on request or at the end "
    "of a recording, 1 an error, 2 wrong usage.";

/// What the command line and the configuration may set, each with its default.
struct Settings {
  session::ServeOptions options;
  std::string at_end = "stay";
  std::string acknowledge = "durable";
  std::string create = "owners";
  double close_after_s = to_seconds(session::ServeOptions().close_after);
  std::string log_level = "info";
  std::string log_format = "text";
  std::string read_folder = ".";
  std::string write_folder = ".";

  /// This must outlive the table.
  void add_to(OptionTable& table);
};

void Settings::add_to(OptionTable& table) {
  constexpr double longest_s = 86'400;
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
}

using Facts = std::vector<OptionFacts>;

/// Reads the same words again, and what their --config names. `running` are the values that hold now, and
/// those that hold afterwards.
Result<session::Reloaded> read_again(const std::vector<std::string>& arguments, Facts& running) {
  Settings again;
  OptionTable table("handloft-modeld serve", description);
  again.add_to(table);
  if (auto outcome = table.parse(arguments); !outcome) return outcome.error();
  session::Reloaded reloaded;
  const auto level = parse_log_level(again.log_level);
  if (!level) return level.error();
  reloaded.log_level = *level;
  reloaded.limits = again.options.limits;
  const Facts found = table.facts().options;
  for (std::size_t i = 0; i < found.size() && i < running.size(); ++i) {
    if (found[i].preset == running[i].preset) continue;
    std::string words =
        fmt::format("{}: {} before, {} now", found[i].flag, running[i].preset, found[i].preset);
    if (found[i].flag == "--log-level" || session::ServiceLimits::holds_at_once(found[i].flag)) {
      reloaded.changed.push_back(std::move(words));
      running[i].preset = found[i].preset;
    } else {
      reloaded.needs_restart.push_back(std::move(words));
    }
  }
  return reloaded;
}

}  // namespace

int serve_command(const std::vector<std::string>& arguments) {
  Settings settings;
  OptionTable table("handloft-modeld serve", description);
  settings.add_to(table);
  auto outcome = table.parse(arguments);
  if (!outcome) {
    std::fprintf(stderr, "handloft-modeld serve: %s\n", outcome.error().describe().c_str());
    return exit_usage;
  }
  if (outcome->action == ParseOutcome::Action::show_text) {
    std::fputs(outcome->text.c_str(), stdout);
    return exit_ok;
  }
  const auto level = parse_log_level(settings.log_level);
  if (!level) {
    std::fprintf(stderr, "handloft-modeld serve: %s\n", level.error().describe().c_str());
    return exit_usage;
  }
  session::ServeOptions& options = settings.options;
  options.log_level = *level;
  options.log_format = settings.log_format == "json" ? LogFormat::json : LogFormat::text;
  Facts running = table.facts().options;
  options.reload = [&arguments, &running] { return read_again(arguments, running); };
  options.acknowledge = settings.acknowledge == "applied" ? session::ActorOptions::Acknowledge::applied
                                                          : session::ActorOptions::Acknowledge::durable;
  options.create = settings.create == "nobody" ? session::RoomsOptions::Create::nobody
                                               : session::RoomsOptions::Create::owners;
  options.close_after = from_seconds(settings.close_after_s);
  options.at_end =
      settings.at_end == "exit" ? session::ServeOptions::AtEnd::exit : session::ServeOptions::AtEnd::stay;
  options.files.read_folder = settings.read_folder;
  options.files.write_folder = settings.write_folder;
  options.files.cad = std::make_shared<const session::CadProcess>();
  share_heaps();
  return session::serve(options, std::cout);
}

void pass_over_serve_options(OptionTable& table) {
  Settings settings;
  OptionTable serve("handloft-modeld serve", description);
  settings.add_to(serve);
  table.pass_over(serve);
}

}  // namespace handloft::model
