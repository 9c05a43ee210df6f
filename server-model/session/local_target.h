#pragma once
// A script target in this process: a model of its own, with files.

#include <utility>

#include "server-model/model/model.h"
#include "server-model/session/resolve_operation.h"
#include "server-model/session/script_target.h"

namespace handloft::model {

/// Submits an operation of any kind to a model: imports are resolved, exports written. What the script runner
/// and the server have in common.
Result<ScriptTarget::Outcome> perform(Model& model, const handloft::v1::Operation& operation,
                                      const FileAccess& files);

class LocalTarget final : public ScriptTarget {
 public:
  explicit LocalTarget(FileAccess files, Model model = Model());
  Result<Outcome> submit(const handloft::v1::Operation& operation) override;
  Result<handloft::v1::QueryResult> query(const handloft::v1::Query& query) override;
  const Model& model() const { return model_; }
  Model take_model() && { return std::move(model_); }

 private:
  Model model_;
  FileAccess files_;
};

}  // namespace handloft::model
