#pragma once
// The model that a server begins with, and how those in its folder are opened.

#include <filesystem>
#include <memory>
#include <string>

#include "common/base/log.h"
#include "common/base/result.h"
#include "server-model/model/model.h"
#include "server-model/session/rooms.h"
#include "server-model/session/serve.h"
#include "server-model/session/server_options.h"
#include "server-model/store/model_store.h"

namespace handloft::session {

struct FirstModel {
  model::Model model;
  std::shared_ptr<store::ModelStore> store = {};  ///< Who keeps it; null: nobody.
  std::string name = ServerOptions().model_name;
  Status nameless = {};  ///< As ServerOptions has it.
};

/// As its file has it; the file is made when missing.
Result<OpenedModel> open_model(const std::filesystem::path& path, const std::string& name, const Logger& log);

/// By what `options` say of a file, a folder and a script: as a file has it, a new one as the script leaves
/// it. A script that fails (the error names its line) leaves the file empty. Of a folder that called as the
/// model of a server without one, else the first by name that can be opened; of a folder without any a new
/// one. In place of one that is there and cannot be opened nobody gets another without asking for it
/// (`nameless`).
Result<FirstModel> first_model(const ServeOptions& options, const Logger& log);

}  // namespace handloft::session
