#pragma once
// The Export operation: fitted shapes of a document (A26), sculpted surfaces and imported models with the
// faces that were sculpted, to a STEP, IGES, glTF or OBJ file. Nothing in the document changes.

#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "proto/operation.pb.h"
#include "server-model/model/document.h"
#include "server-model/session/resolve_operation.h"

namespace handloft::model {

struct Exported {
  std::filesystem::path path;
  std::vector<std::string> entities;  ///< Written, ascending.
  std::vector<std::string> notes;
};

/// Without named entities: every fitted shape, every sculpted surface and every model. A model's faces are
/// written with it, and by themselves when they are named and the model is not.
///
/// Writes to a temporary file beside the target and renames it, so that a full disk leaves an old file
/// intact. Errors: not_found (entity), failed_precondition (not fitted, or nothing fitted), unsupported
/// (unknown extension), io, permission_denied, invalid_argument (a shape that the format can't hold). The
/// field is the request's: what failed with the file is export.path, with a shape export.entities, and then
/// the message begins with the shape's id.
Result<Exported> export_document(const Document& document, const handloft::v1::Export& request,
                                 const FileAccess& files);

}  // namespace handloft::model
