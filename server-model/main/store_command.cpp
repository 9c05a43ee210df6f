#include "server-model/main/store_command.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "common/base/config.h"
#include "server-model/exchange/atomic_file.h"
#include "server-model/main/standard_output.h"
#include "server-model/model/canonical.h"
#include "server-model/session/cad_process.h"
#include "server-model/session/export.h"
#include "server-model/session/parallel.h"
#include "server-model/session/script_json.h"
#include "server-model/store/backup.h"
#include "server-model/store/log_check.h"
#include "server-model/store/operation_log.h"
#include "server-model/store/recovery.h"
#include "server-model/store/repair.h"
#include "server-model/store/summary.h"

namespace handloft::model {

namespace v1 = handloft::v1;

namespace {

using Json = nlohmann::ordered_json;
using store::OperationLog;
namespace fs = std::filesystem;

/// What a command found: words for people, the same as JSON, and how it ends.
struct Findings {
  std::string words;
  Json json = Json::object();
  ExitStatus status = exit_ok;
};

std::string utc(std::int64_t time_ns) {
  constexpr std::int64_t second_ns = 1'000'000'000;
  const auto seconds = static_cast<std::time_t>(time_ns / second_ns);
  std::tm calendar{};
  gmtime_r(&seconds, &calendar);
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", calendar);
}

Json damages_json(const std::vector<store::Damage>& damages) {
  Json list = Json::array();
  for (const store::Damage& damage : damages)
    list.push_back({{"where", damage.where}, {"what", damage.what}});
  return list;
}

// --- versions

/// The last state: versions and alternatives are what the operations made of them, and are nowhere else.
Result<Document> document_of(const OperationLog& log) {
  auto recovered = store::recover(log, context_on_all_cores());
  if (!recovered) return recovered.error();
  return recovered->model.document();
}

Json versions_json(const std::vector<store::NamedVersion>& versions) {
  Json list = Json::array();
  for (const store::NamedVersion& version : versions) {
    list.push_back({{"name", version.name},
                    {"sequence", version.sequence},
                    {"alternative", version.alternative},
                    {"author", version.author},
                    {"time", utc(version.made_ns)},
                    {"note", version.note}});
  }
  return list;
}

Json alternatives_json(const std::vector<store::NamedAlternative>& alternatives) {
  Json list = Json::array();
  for (const store::NamedAlternative& alternative : alternatives)
    list.push_back({{"name", alternative.name}, {"version", alternative.version}});
  return list;
}

// --- models

constexpr std::string_view suffix = ".handloft";

/// What the file says of itself; checked: every record, and the model restored.
enum class Listing { as_told, checked };

Status problem_of(const OperationLog& log) {
  const store::LogCheck check = store::check_log(log);
  if (!check.good()) return make_error(ErrorCode::data_corrupt, check.damages.front().words());
  auto document = document_of(log);
  return document ? Status() : Status(document.error());
}

/// Its words, added to `found`.
Result<Json> list_model(const fs::path& path, Listing listing, Findings& found) {
  auto log = OperationLog::open(path, OperationLog::Access::read);
  if (!log) return log.error();
  const auto summary = store::summarize(*log, context_on_all_cores());
  std::error_code failed;
  const auto size = fs::file_size(path, failed);
  Json one{{"file", path.filename().string()},
           {"operations", log->last_sequence()},
           {"created", utc(log->identity().created_ns)},
           {"bytes", size}};
  if (summary) {
    one["changed"] = utc(summary->changed_ns);
    one["versions"] = versions_json(summary->versions);
    one["alternatives"] = alternatives_json(summary->alternatives);
  }
  found.words += fmt::format(
      "{}: {} operations since {}, last {}, {} named versions, {:.1f} MB\n", path.filename().string(),
      log->last_sequence(), utc(log->identity().created_ns), summary ? utc(summary->changed_ns) : "unknown",
      summary ? std::to_string(summary->versions.size()) : "unknown", 1e-6 * static_cast<double>(size));
  if (summary) {
    for (const store::NamedVersion& version : summary->versions)
      found.words += fmt::format("  \"{}\" of \"{}\" after operation {}\n", version.name, version.alternative,
                                 version.sequence);
    if (summary->alternatives.size() > 1)
      found.words += fmt::format("  {} alternatives\n", summary->alternatives.size());
  }
  const Status problem = !summary                      ? Status(summary.error())
                         : listing == Listing::checked ? problem_of(*log)
                                                       : log->holds_what_was_saved();
  if (!problem) {
    one["problem"] = problem.error().message;
    found.words += fmt::format("  {}\n", problem.error().message);
    found.status = exit_failed;
  }
  return one;
}

Result<Findings> list_models(const std::string& folder, Listing listing) {
  std::error_code failed;
  std::vector<fs::path> paths;
  for (fs::directory_iterator entry(folder, failed), end; !failed && entry != end; entry.increment(failed)) {
    if (entry->path().extension() == suffix && entry->is_regular_file()) paths.push_back(entry->path());
  }
  if (failed)
    return make_error(ErrorCode::not_found, fmt::format("{}: {}", folder, failed.message()), "FOLDER");
  std::sort(paths.begin(), paths.end());
  Findings found;
  found.json["models"] = Json::array();
  for (const fs::path& path : paths) {
    auto one = list_model(path, listing, found);
    if (!one) {
      found.words += fmt::format("{}: {}\n", path.filename().string(), one.error().message);
      found.status = exit_failed;
      one = Json{{"file", path.filename().string()}, {"problem", one.error().message}};
    }
    found.json["models"].push_back(*std::move(one));
  }
  if (paths.empty()) found.words = fmt::format("no *{} in {}\n", suffix, folder);
  return found;
}

/// An option's value that the model does not have: wrong usage, not a fault of the file.
Error wrong_option(std::string message, std::string flag) {
  return make_error(ErrorCode::invalid_argument, std::move(message), std::move(flag));
}

Error no_such_operation(std::uint64_t asked, const OperationLog& log, std::string flag) {
  return wrong_option(log.last_sequence() == 0
                          ? fmt::format("found {}, but the model has no operations yet, expected 0", asked)
                          : fmt::format("found {}, expected 1 to {}, the model's last operation, or 0", asked,
                                        log.last_sequence()),
                      std::move(flag));
}

// --- history

/// The user's name as the operation has it; empty: nobody has told.
std::string author_of(const store::LogRecord& record) {
  v1::Operation operation;
  return operation.ParseFromString(record.operation) ? operation.author() : std::string();
}

/// "Ann (client 7)": the same person may be at two places.
std::string told_author(const std::string& author, std::uint64_t client_id) {
  const std::string client = fmt::format("client {}", client_id);
  return author.empty() ? client : fmt::format("{} ({})", author, client);
}

Result<Findings> tell_history(const std::string& file, std::uint64_t from, std::uint64_t count) {
  auto log = OperationLog::open(file, OperationLog::Access::read);
  if (!log) return log.error();
  const std::uint64_t last = log->last_sequence();
  if (from > last) return no_such_operation(from, *log, "--from");
  if (from == 0) from = last >= count ? last - count + 1 : 1;
  Findings found;
  found.json = {{"last", last}, {"operations", Json::array()}};
  // Of a damaged file the operations before the damage are told all the same.
  std::multimap<std::uint64_t, std::string> named;
  if (auto document = document_of(*log)) {
    const auto versions = store::named_versions(*document);
    found.json["versions"] = versions_json(versions);
    for (const store::NamedVersion& version : versions) named.emplace(version.sequence, version.name);
    found.json["alternatives"] = alternatives_json(store::named_alternatives(*document));
  } else {
    found.json["problem"] = document.error().message;
  }
  std::uint64_t told = 0;
  auto status = log->read(from, [&](const store::LogEntry& entry) -> Status {
    if (told++ == count) return make_error(ErrorCode::cancelled, "enough");
    const store::LogRecord& record = entry.record;
    const std::string words = store::answer_of(record).words;
    const std::string author = author_of(record);
    found.json["operations"].push_back({{"sequence", record.sequence},
                                        {"time", utc(record.time_ns)},
                                        {"author", author},
                                        {"client", record.client_id},
                                        {"words", words},
                                        {"bytes", record.operation.size()}});
    found.words += fmt::format("{:>8}  {}  {}  {}\n", record.sequence, utc(record.time_ns),
                               told_author(author, record.client_id), words);
    for (auto [name, end] = named.equal_range(record.sequence); name != end; ++name)
      found.words += fmt::format("          version \"{}\"\n", name->second);
    return {};
  });
  if (!status && status.error().code != ErrorCode::cancelled) return status.error();
  if (found.words.empty()) found.words = "no operations\n";
  if (const Status saved = log->holds_what_was_saved(); !saved) {
    found.json["problem"] = saved.error().message;
    found.words += fmt::format("damaged: {}\n", saved.error().message);
    found.status = exit_failed;
  }
  return found;
}

// --- verify

Result<Findings> verify(const std::string& file, bool replay) {
  auto log = OperationLog::open(file, OperationLog::Access::read);
  if (!log) {
    Error error = log.error();
    if (error.code == ErrorCode::data_corrupt)
      error.message +=
          fmt::format("; `handloft-modeld repair {}` writes what can be read to another file", file);
    return error;
  }
  const store::LogCheck check = store::check_log(*log);
  Findings found;
  found.json = {{"good", check.good()},
                {"operations", check.operations},
                {"good_sequence", check.good_sequence},
                {"damages", damages_json(check.damages)},
                {"bad_snapshots", damages_json(check.bad_snapshots)}};
  for (const store::Damage& damage : check.damages)
    found.words += fmt::format("damaged: {}\n", damage.words());
  for (const store::Damage& damage : check.bad_snapshots)
    found.words += fmt::format("not usable, nothing is lost: {}\n", damage.words());
  if (replay && check.good()) {
    store::RecoveryOptions options;
    options.snapshots = store::RecoveryOptions::Snapshots::ignored;
    auto replayed = store::recover(*log, context_on_all_cores(), options);
    if (!replayed) return replayed.error();
    auto recovered = store::recover(*log, context_on_all_cores());
    if (!recovered) return recovered.error();
    const std::string hash = document_hash(replayed->model.document());
    const bool same = hash == document_hash(recovered->model.document());
    found.json["hash"] = hash;
    found.json["snapshots_agree"] = same;
    found.words += same ? fmt::format("replayed: {}\n", hash)
                        : std::string("damaged: the snapshot and the operations give different models\n");
    if (!same) found.status = exit_failed;
  }
  if (check.good() && found.status == exit_ok)
    found.words += fmt::format("good: {} operations\n", check.operations);
  if (!check.good()) {
    found.status = exit_failed;
    found.words += fmt::format(
        "{} operations are good up to there; `handloft-modeld repair {}` writes them to another "
        "file\n",
        check.good_sequence, file);
  }
  return found;
}

// --- repair

Result<Findings> repair_file(const std::string& file, std::string to) {
  if (to.empty()) {
    const fs::path path(file);
    to = (path.parent_path() / (path.stem().string() + ".repaired" + path.extension().string())).string();
  }
  auto repaired = store::repair(file, to);
  if (!repaired) return repaired.error();
  Findings found;
  found.json = {
      {"to", to}, {"operations", repaired->operations}, {"damages", damages_json(repaired->damages)}};
  for (const store::Damage& damage : repaired->damages)
    found.words += fmt::format("damaged: {}\n", damage.words());
  found.words += fmt::format("{} operations are in {}; {} is as it was\n", repaired->operations, to, file);
  return found;
}

// --- backup

Result<Findings> backup_file(const std::string& file, const std::string& to) {
  auto backup = store::back_up(file, to);
  if (!backup) return backup.error();
  Findings found;
  found.json = {{"to", to}, {"operations", backup->operations}, {"bytes", backup->bytes}};
  found.words = fmt::format("{} operations are in {}, checked\n", backup->operations, to);
  return found;
}

// --- export

Result<std::uint64_t> moment(const OperationLog& log, std::uint64_t at, const std::string& version,
                             std::string& digest) {
  if (at > log.last_sequence()) return no_such_operation(at, log, "--at");
  if (version.empty()) return at == 0 ? ~std::uint64_t{0} : at;
  auto document = document_of(log);
  if (!document) return document.error();
  const auto found = document->versions->find(version);
  if (found == document->versions->end() || found->second->sequence == 0)
    return wrong_option(
        fmt::format(
            "found \"{}\", expected a named version of the model (`handloft-modeld models` lists them)",
            version),
        "--named");
  digest = found->second->digest;
  return found->second->sequence;
}

/// Whose steps undo takes back in a script: each client's, or of all as if they were one.
enum class ScriptClients { each, one };

/// The operations up to `until`, as a script that `run` takes has them.
Status each_of_script(const OperationLog& log, std::uint64_t until, ScriptClients clients,
                      const std::function<Status(const v1::Operation&)>& visit) {
  auto status = log.read(1, [&](const store::LogEntry& entry) -> Status {
    if (entry.record.sequence > until) return make_error(ErrorCode::cancelled, "enough");
    v1::Operation operation;
    if (!operation.ParseFromString(entry.record.operation))
      return make_error(ErrorCode::data_corrupt,
                        fmt::format("operation {} can't be read", entry.record.sequence));
    operation.clear_client_op_id();  // Nothing of a script is retried.
    if (clients == ScriptClients::one) operation.clear_client_id();
    return visit(operation);
  });
  if (!status && status.error().code != ErrorCode::cancelled) return status;
  return {};
}

/// A script is run by the present rules of undo. Where operations were made by older ones, it is tried out
/// that the same model comes of it.
Result<ScriptClients> clients_for_script(const OperationLog& log, std::uint64_t until) {
  if (log.rules().fair_from <= 1) return ScriptClients::each;
  store::RecoveryOptions options;
  options.until = until;
  auto recovered = store::recover(log, context_on_all_cores(), options);
  if (!recovered) return recovered.error();
  const std::string hash = document_hash(recovered->model.document());
  for (const ScriptClients clients : {ScriptClients::each, ScriptClients::one}) {
    Model model(Document{}, context_on_all_cores());
    const Status played = each_of_script(log, until, clients, [&](const v1::Operation& operation) -> Status {
      auto submitted = model.submit(operation);
      return submitted ? Status() : Status(submitted.error());
    });
    if (played && document_hash(model.document()) == hash) return clients;
  }
  return make_error(ErrorCode::unsupported,
                    fmt::format("operations before {} were made when undo went by other rules, and by the "
                                "present ones a script of them makes another model; expected a format that "
                                "holds the model itself",
                                std::min(log.rules().fair_from, log.last_sequence() + 1)),
                    "TO");
}

/// As a script that `run` takes: SCRIPT.md.
Result<Findings> export_script(const OperationLog& log, const fs::path& to, std::uint64_t until) {
  const auto clients = clients_for_script(log, until);
  if (!clients) return clients.error();
  std::string script;
  std::uint64_t lines = 0;
  const Status status = each_of_script(log, until, *clients, [&](const v1::Operation& operation) -> Status {
    auto json = to_json(operation);
    if (!json) return json.error();
    script += *json + "\n";
    ++lines;
    return {};
  });
  if (!status) return status.error();
  if (auto written = exchange::write_file_atomically(to, script); !written) return written.error();
  Findings found;
  found.json = {{"to", to.string()}, {"operations", lines}};
  found.words = fmt::format("{} operations are in {}\n", lines, to.string());
  return found;
}

/// No export writes over a model, which is nothing but what was done to it, nor over the users of a server.
Status check_target(const std::string& to) {
  constexpr std::string_view begin_of_database = "SQLite format 3";
  std::string begin(begin_of_database.size(), '\0');
  std::ifstream there(to, std::ios::binary);
  there.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  if (begin != begin_of_database) return {};
  return make_error(
      ErrorCode::already_exists,
      fmt::format("{} is a model or another database, expected a file to write over or none", to), "TO");
}

Result<Findings> export_file(const std::string& file, const std::string& to, std::uint64_t at,
                             const std::string& version) {
  if (const Status free = check_target(to); !free) return free.error();
  auto log = OperationLog::open(file, OperationLog::Access::read);
  if (!log) return log.error();
  // What is asked for by its number is as it was; the newest state would lack something.
  if (at == 0 && version.empty()) {
    if (const Status saved = log->holds_what_was_saved(); !saved) return saved.error();
  }
  store::RecoveryOptions options;
  std::string digest;
  auto until = moment(*log, at, version, digest);
  if (!until) return until.error();
  options.until = *until;
  if (fs::path(to).extension() == ".jsonl") return export_script(*log, to, *until);
  auto recovered = store::recover(*log, context_on_all_cores(), options);
  if (!recovered) return recovered.error();
  if (!digest.empty() && EntityDigests().of(recovered->model.document().entities) != digest) {
    return make_error(
        ErrorCode::data_corrupt,
        fmt::format("operation {} gives another model than version \"{}\" holds", *until, version),
        "--named");
  }
  FileAccess files;
  files.cad = std::make_shared<const session::CadProcess>();
  v1::Export request;
  request.set_path(to);
  auto exported = export_document(recovered->model.document(), request, files);
  if (!exported) return exported.error();
  Findings found;
  found.json = {{"to", to},
                {"sequence", recovered->model.sequence()},
                {"hash", document_hash(recovered->model.document())},
                {"entities", exported->entities},
                {"notes", exported->notes}};
  for (const std::string& note : exported->notes) found.words += note + "\n";
  found.words += fmt::format("{} as after operation {} is in {}\n", file, recovered->model.sequence(), to);
  return found;
}

/// All that the commands take; each asks for what it knows.
struct Arguments {
  std::string file;
  std::string to;
  std::string version;
  std::uint64_t at = 0;
  std::uint64_t from = 0;
  std::uint64_t count = 100;
  bool replay = false;
  bool verify = false;
  bool json = false;
};

Status check_moment(const OptionTable& table, const Arguments& given) {
  if (!table.given("named")) return {};
  if (given.version.empty()) return wrong_option("found nothing, expected a version's name", "--named");
  if (table.given("at"))
    return wrong_option("found both --at and --named, expected one of them: each says which state", "--at");
  return {};
}

struct Command {
  const char* description;
  std::function<void(OptionTable&, Arguments&)> options;
  std::function<Result<Findings>(const Arguments&)> run;
  /// What the table by itself does not see; may be empty.
  std::function<Status(const OptionTable&, const Arguments&)> check = {};
};

const std::map<std::string, Command>& commands() {
  using Presence = OptionTable::Presence;
  const auto file = [](OptionTable& table, Arguments& to) {
    table.add_positional("FILE", to.file, "The model", Presence::required);
  };
  static const std::map<std::string, Command> table = {
      {"models",
       {"Lists the models in a folder.",
        [](OptionTable& options, Arguments& to) {
          to.file = ".";
          options.add_positional("FOLDER", to.file, "Where *.handloft lie; none: here", Presence::optional);
          options.add("verify", to.verify, "Also check every record of each and restore it");
        },
        [](const Arguments& given) {
          return list_models(given.file, given.verify ? Listing::checked : Listing::as_told);
        }}},
      {"history",
       {"Tells what was done to a model, by whom and when.",
        [file](OptionTable& options, Arguments& to) {
          file(options, to);
          options.add("from", to.from,
                      "The first operation to tell of, up to the model's last; 0: the last ones");
          options.add("count", to.count, "How many operations", NumberRange{.min = 1, .max = 1e9});
        },
        [](const Arguments& given) { return tell_history(given.file, given.from, given.count); }}},
      {"verify",
       {"Checks every record of a model against its checksum and its place, and tells what is damaged. "
        "Changes nothing of it.",
        [file](OptionTable& options, Arguments& to) {
          file(options, to);
          options.add("replay", to.replay, "Also apply every operation anew and compare with the snapshots");
        },
        [](const Arguments& given) { return verify(given.file, given.replay); }}},
      {"repair",
       {"Writes what is good of a damaged model to another file. The damaged one stays as it is.",
        [file](OptionTable& options, Arguments& to) {
          file(options, to);
          options.add("to", to.to, "The new file; none: FILE with .repaired in its name",
                      TextRule{.choices = {}, .value_name = "FILE"});
        },
        [](const Arguments& given) { return repair_file(given.file, given.to); }}},
      {"backup",
       {"Copies a model as it is now to another file, while a server may be writing it, and checks the copy.",
        [file](OptionTable& options, Arguments& to) {
          file(options, to);
          options.add_positional("TO", to.to, "The copy; never one that is there", Presence::required);
        },
        [](const Arguments& given) { return backup_file(given.file, given.to); }}},
      {"export",
       {"Writes a model, as it is or was, as STEP, IGES, GLB or OBJ, or as a script of its operations "
        "(.jsonl).",
        [file](OptionTable& options, Arguments& to) {
          file(options, to);
          options.add_positional("TO", to.to, "What to write", Presence::required);
          options.add("at", to.at, "As after this operation, up to the model's last; 0: the last");
          options.add("named", to.version, "As this named version was; not together with --at",
                      TextRule{.choices = {}, .value_name = "NAME"});
        },
        [](const Arguments& given) { return export_file(given.file, given.to, given.at, given.version); },
        check_moment}},
  };
  return table;
}

}  // namespace

bool is_store_command(const std::string& command) {
  return commands().contains(command);
}

ExitStatus store_command(const std::string& name, const std::vector<std::string>& arguments) {
  const Command& command = commands().at(name);
  const auto complain = [&](const Error& error) {
    std::fprintf(stderr, "handloft-modeld %s: %s\n", name.c_str(), error.describe().c_str());
  };
  Arguments given;
  OptionTable table("handloft-modeld " + name, command.description);
  command.options(table, given);
  table.add("json", given.json, "Answer with one line of JSON");
  auto outcome = table.parse(arguments);
  if (!outcome) {
    complain(outcome.error());
    return exit_usage;
  }
  if (outcome->action == ParseOutcome::Action::show_text) {
    std::fputs(outcome->text.c_str(), stdout);
    return exit_ok;
  }
  if (command.check) {
    if (const Status checked = command.check(table, given); !checked) {
      complain(checked.error());
      return exit_usage;
    }
  }
  auto found = command.run(given);
  if (!found) {
    const Error& error = found.error();
    complain(error);
    return error.code == ErrorCode::invalid_argument && error.field.starts_with("--") ? exit_usage
                                                                                      : exit_failed;
  }
  const std::string text =
      given.json ? found->json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n" : found->words;
  if (const Status told = tell(text); !told) {
    complain(told.error());
    return exit_failed;
  }
  return found->status;
}

}  // namespace handloft::model
