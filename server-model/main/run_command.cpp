#include "server-model/main/run_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <set>
#include <utility>

#include "common/base/clock.h"
#include "common/base/config.h"
#include "common/net/endpoint.h"
#include "server-model/access/roles.h"
#include "server-model/session/cad_process.h"
#include "server-model/session/local_target.h"
#include "server-model/session/parallel.h"
#include "server-model/session/remote_target.h"
#include "server-model/session/script_runner.h"

namespace handloft::model {

namespace {

constexpr const char* description =
    "Runs a script (see SCRIPT.md): each line of JSON is an operation, a query or an expectation, and is "
    "answered by "
    "one line of JSON on standard output. Exit status: 0 all lines succeeded, 1 a line failed, 2 wrong "
    "usage.";

void complain(const std::string& message) {
  std::fprintf(stderr, "handloft-modeld run: %s\n", message.c_str());
}

// A server with files placed by this process: imports are read here and sent as points, and exports that the
// server writes for us (same host, same user) go where our relative paths mean them to.
class ConnectedTarget final : public ScriptTarget {
 public:
  enum class Exports { to_our_folder, to_servers_folder };
  ConnectedTarget(session::RemoteTarget server, FileAccess files, Exports exports)
      : server_(std::move(server)), files_(std::move(files)), exports_(exports) {}

  Result<Outcome> submit(const handloft::v1::Operation& operation) override {
    auto resolved = resolve_operation(operation, files_);
    if (!resolved) return resolved.error();
    if (resolved->has_export_() && exports_ == Exports::to_our_folder) {
      auto path = files_.to_write(resolved->export_().path(), "export.path");
      if (!path) return path.error();
      std::error_code failed;
      const auto absolute = std::filesystem::absolute(*path, failed);
      if (failed) return make_error(ErrorCode::io, failed.message(), "export.path");
      resolved->mutable_export_()->set_path(absolute.string());
    }
    if (const Status status = as_one_client(operation); !status) return status.error();
    auto submitted = server_.submit(*resolved);
    if (submitted && submitted->sequence != 0) made_steps_.insert(operation.client_id());
    return submitted;
  }
  Result<handloft::v1::QueryResult> query(const handloft::v1::Query& query) override {
    return server_.query(query);
  }

 private:
  /// To the server all lines are of one client, whose steps undo takes back: those of several are the same
  /// only until the first undo.
  Status as_one_client(const handloft::v1::Operation& operation) const {
    if (!operation.has_undo() && !operation.has_redo()) return {};
    const auto other = std::find_if(made_steps_.begin(), made_steps_.end(),
                                    [&](std::uint64_t client) { return client != operation.client_id(); });
    if (other == made_steps_.end()) return {};
    return make_error(
        ErrorCode::failed_precondition,
        fmt::format("found {} by client {} after steps by client {}, expected one client: a "
                    "server takes all lines as one client's. Without --connect each has its own",
                    operation.has_undo() ? "an undo" : "a redo", operation.client_id(), *other),
        "client_id");
  }

  session::RemoteTarget server_;
  FileAccess files_;
  Exports exports_;
  std::set<std::uint64_t> made_steps_;  ///< Who of the script.
};

Result<std::unique_ptr<ScriptTarget>> make_target(const std::string& connect,
                                                  session::RemoteTargetOptions remote,
                                                  const FileAccess& files, const Clock& clock) {
  if (connect.empty())
    return std::unique_ptr<ScriptTarget>(
        std::make_unique<LocalTarget>(files, Model(Document{}, context_on_all_cores())));
  auto endpoint = net::parse_endpoint(connect);
  if (!endpoint) return endpoint.error();
  auto server = session::RemoteTarget::connect(*endpoint, clock, std::move(remote));
  if (!server) return server.error();
  const auto exports = endpoint->kind == net::Endpoint::Kind::unix_socket
                           ? ConnectedTarget::Exports::to_our_folder
                           : ConnectedTarget::Exports::to_servers_folder;
  return std::unique_ptr<ScriptTarget>(std::make_unique<ConnectedTarget>(std::move(*server), files, exports));
}

/// What would else do nothing: who lost --connect on the way would believe that a server keeps the lines.
Status check_connection(const OptionTable& table, const std::string& connect) {
  if (!connect.empty()) return {};
  if (table.given("connect"))
    return make_error(ErrorCode::invalid_argument, "found nothing, expected a server's endpoint",
                      "--connect");
  for (const auto& [key, flag] : {std::pair("role", "--role"), std::pair("model", "--model"),
                                  std::pair("save", "--save"), std::pair("reconnect_s", "--reconnect-s")}) {
    if (!table.given(key)) continue;
    return make_error(
        ErrorCode::invalid_argument,
        "found it without --connect, expected --connect ENDPOINT beside it: without a server the model is "
        "gone afterwards",
        flag);
  }
  return {};
}

}  // namespace

ExitStatus run_command(const std::vector<std::string>& arguments) {
  std::string script;
  std::string input_dir = ".";
  std::string output_dir = ".";
  std::string connect;
  std::string role = "editor";
  std::string model;
  std::string save = "configured";
  bool keep_going = false;
  double reconnect_s = 30;
  constexpr double longest_reconnect_s = 3600;
  OptionTable table("handloft-modeld run", description);
  table.add_positional("SCRIPT", script, "The script, or - for standard input",
                       OptionTable::Presence::required);
  table.add("input_dir", input_dir, "Folder that relative paths of imports start from",
            TextRule{.choices = {}, .value_name = "DIR"});
  table.add("output_dir", output_dir, "Folder that relative paths of exports start from; made when missing",
            TextRule{.choices = {}, .value_name = "DIR"});
  table.add("connect", connect, "Drive the server at this endpoint instead of a model of our own",
            TextRule{.choices = {}, .value_name = "ENDPOINT"});
  table.add("role", role, "With --connect: as what; the server refuses more than you may",
            TextRule{.choices = {"viewer", "commenter", "editor", "owner"}, .value_name = ""});
  table.add("model", model, "With --connect: which of the server's models; none: its first",
            TextRule{.choices = {}, .value_name = "NAME"});
  table.add("save", save, "With --connect: how safe a line is to be when it is answered",
            TextRule{.choices = {"configured", "durable", "applied"}, .value_name = ""});
  table.add("reconnect_s", reconnect_s,
            "With --connect: when the server is restarted, so many seconds to find it again and go on, where "
            "it keeps what it answers on its disk; 0: end",
            NumberRange{.min = 0, .max = longest_reconnect_s, .value_name = "S"});
  table.add("keep_going", keep_going, "Go on after a failed line; the exit status is 1 all the same");
  auto outcome = table.parse(arguments);
  if (!outcome) {
    complain(outcome.error().describe());
    return exit_usage;
  }
  if (outcome->action == ParseOutcome::Action::show_text) {
    std::fputs(outcome->text.c_str(), stdout);
    return exit_ok;
  }
  if (const Status connection = check_connection(table, connect); !connection) {
    complain(connection.error().describe());
    return exit_usage;
  }

  std::ifstream file;
  if (script != "-") {
    file.open(script, std::ios::binary);
    std::error_code ignored;
    if (!file || std::filesystem::is_directory(script, ignored)) {
      complain("cannot open the script \"" + script + "\"");
      return exit_usage;
    }
  }
  std::error_code failed;
  std::filesystem::create_directories(output_dir, failed);
  if (failed) {
    complain("cannot make the folder \"" + output_dir + "\": " + failed.message());
    return exit_usage;
  }

  FileAccess files;
  files.read_folder = input_dir;
  files.write_folder = output_dir;
  files.cad = std::make_shared<const session::CadProcess>();
  const SystemClock clock;
  const auto asked_role = access::parse_role(role);
  if (!asked_role) {
    complain(asked_role.error().describe());
    return exit_usage;
  }
  session::RemoteTargetOptions remote;
  remote.role = *asked_role;
  remote.model = model;
  constexpr double ms_per_s = 1000;
  remote.come_again_within = std::chrono::milliseconds(static_cast<std::int64_t>(reconnect_s * ms_per_s));
  if (save != "configured") {
    remote.answer_when =
        save == "durable" ? handloft::v1::SAVE_LEVEL_DURABLE : handloft::v1::SAVE_LEVEL_APPLIED;
  }
  auto target = make_target(connect, std::move(remote), files, clock);
  if (!target) {
    complain(target.error().describe());
    return exit_usage;
  }
  ScriptOptions options;
  if (keep_going) options.on_failure = ScriptOptions::OnFailure::keep_going;
  std::ios::sync_with_stdio(false);
  const ScriptSummary summary = run_script(script == "-" ? std::cin : file, std::cout, **target, options);
  if (!std::cout) {
    complain("cannot write the answers to standard output");
    return exit_failed;
  }
  if (!summary.ok()) {
    complain("line " + std::to_string(summary.first_failed_line) + ": " + summary.first_failure);
    if (summary.lines_failed > 1) complain(std::to_string(summary.lines_failed) + " lines failed in all");
    return exit_failed;
  }
  return exit_ok;
}

}  // namespace handloft::model
