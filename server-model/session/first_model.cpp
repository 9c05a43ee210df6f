#include "server-model/session/first_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <utility>
#include <vector>

#include "common/base/wall_clock.h"
#include "server-model/session/local_target.h"
#include "server-model/session/parallel.h"
#include "server-model/session/script_runner.h"

namespace handloft::session {
namespace {

/// What may wait for a disk before the next operation of a script does.
constexpr std::size_t operations_at_once = 1000;
constexpr std::size_t bytes_at_once = 16U << 20U;

/// What the script makes, kept by nobody; a failing line is an error that names it. `done`, unless null, gets
/// every operation in the form that may be applied anywhere.
Result<model::Model> scripted_model(const ServeOptions& options, std::vector<v1::Operation>* done) {
  model::Model model(model::Document(), model::context_on_all_cores());
  if (options.script.empty()) return model;
  if (done != nullptr) {
    model.keep_in({[](auto...) { return std::nullopt; }, [] { return Status(); },
                   [done](const model::Submitted& submitted, const model::Model&) {
                     done->push_back(submitted.effective);
                   }});
  }
  model::LocalTarget target(options.files, std::move(model));
  std::ifstream file(options.script, std::ios::binary);
  if (!file) return make_error(ErrorCode::io, "cannot open \"" + options.script + "\"", "script");
  std::ostringstream answers;  // standard output is for the line that says "ready"
  const model::ScriptSummary summary = model::run_script(file, answers, target);
  if (!summary.ok()) {
    return make_error(
        ErrorCode::failed_precondition,
        options.script + ":" + std::to_string(summary.first_failed_line) + ": " + summary.first_failure,
        "script");
  }
  return std::move(target).take_model();
}

/// As its file has it; a new one as the script leaves it.
Result<FirstModel> kept_model(const ServeOptions& options, const std::filesystem::path& path,
                              std::string name, const Logger& log) {
  auto opened = open_model(path, name, log);
  if (!opened) return opened.error();
  FirstModel first{std::move(opened->model), std::move(opened->store), std::move(name)};
  if (options.script.empty()) return first;
  if (first.model.sequence() != 0) {
    log.with("model", first.name)
        .warning("\"{}\" is not run: {} has {} operations already", options.script, path.string(),
                 first.model.sequence());
    return first;
  }
  // Nothing comes into the file before all has gone well: with the half of it the next start would go on.
  std::vector<v1::Operation> operations;
  if (auto scripted = scripted_model(options, &operations); !scripted) return scripted.error();
  std::size_t waiting = 0, bytes = 0;
  for (const v1::Operation& operation : operations) {
    if (auto submitted = first.model.submit(operation); !submitted) return submitted.error();
    bytes += operation.ByteSizeLong();
    if (++waiting < operations_at_once && bytes < bytes_at_once) continue;
    first.store->flush();
    waiting = bytes = 0;
  }
  first.store->flush();
  if (const Status kept = first.store->failure(); !kept) return kept.error();
  return first;
}

/// The model in the folder that a server begins with.
Result<FirstModel> first_of_folder(const ServeOptions& options, const Logger& log) {
  const std::filesystem::path folder = options.models;
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed)
    return make_error(ErrorCode::io, "cannot make \"" + options.models + "\": " + failed.message(), "models");
  std::vector<std::string> names = model_names_in(folder);
  const std::string main = ServerOptions().model_name;
  if (names.empty()) names.push_back(main);
  // Whatever is made beside it, who names no model comes to the same one after a restart.
  if (const auto at = std::find(names.begin(), names.end(), main); at != names.end())
    std::rotate(names.begin(), at, at + 1);
  Result<FirstModel> first = make_error(ErrorCode::not_found, "no model", "models");
  Status nameless;
  for (std::string& name : names) {
    const auto path = folder / (name + std::string(model_suffix));
    const bool is_main = name == main;
    first = kept_model(options, path, std::move(name), log);
    if (first || first.error().field == "script") break;
    log.with("model", path.stem().string()).error("{}: {}", path.string(), first.error().message);
    if (!is_main) continue;
    nameless = make_error(first.error().code,
                          fmt::format("the model \"{}\", which an empty name means, could not be opened when "
                                      "the server started: {}",
                                      main, first.error().message),
                          "join.model");
  }
  if (first) first->nameless = std::move(nameless);
  return first;
}

}  // namespace

Result<OpenedModel> open_model(const std::filesystem::path& path, const std::string& name,
                               const Logger& log) {
  store::ModelStoreOptions options;
  options.now_ns = wall_clock_ns;
  auto opened = store::ModelStore::open(path, model::context_on_all_cores(), std::move(options));
  if (!opened) return make_error(opened.error().code, opened.error().message, "store");
  log.with("model", name)
      .info("{}: {} operations, of which {} were replayed", path.string(), opened->model.sequence(),
            opened->replayed);
  return OpenedModel{std::move(opened->model), std::move(opened->store)};
}

Result<FirstModel> first_model(const ServeOptions& options, const Logger& log) {
  if (!options.models.empty()) {
    if (options.store.empty()) return first_of_folder(options, log);
    return make_error(ErrorCode::invalid_argument, "found a file and a folder, expected one of them",
                      "models");
  }
  if (!options.store.empty()) return kept_model(options, options.store, ServerOptions().model_name, log);
  auto model = scripted_model(options, nullptr);
  if (!model) return model.error();
  return FirstModel{*std::move(model)};
}

}  // namespace handloft::session
