#include "server-model/session/local_target.h"

#include <utility>

#include "server-model/session/export.h"

namespace handloft::model {

Result<ScriptTarget::Outcome> perform(Model& model, const handloft::v1::Operation& operation,
                                      const FileAccess& files) {
  ScriptTarget::Outcome outcome;
  if (operation.has_export_()) {
    auto exported = export_document(model.document(), operation.export_(), files);
    if (!exported) return exported.error();
    outcome.entities = std::move(exported->entities);
    outcome.notes = std::move(exported->notes);
    return outcome;
  }
  auto resolved = resolve_operation(operation, files, model.limits());
  if (!resolved) return resolved.error();
  auto submitted = model.submit(*resolved);
  if (!submitted) return submitted.error();
  outcome.sequence = submitted->sequence;
  outcome.entities = submitted->changes.all();
  outcome.notes = std::move(submitted->notes);
  return outcome;
}

LocalTarget::LocalTarget(FileAccess files, Model model)
    : model_(std::move(model)), files_(std::move(files)) {}

Result<ScriptTarget::Outcome> LocalTarget::submit(const handloft::v1::Operation& operation) {
  return perform(model_, operation, files_);
}

Result<handloft::v1::QueryResult> LocalTarget::query(const handloft::v1::Query& query) {
  return model_.query(query);
}

}  // namespace handloft::model
