#pragma once
// Operations that touch files, made into what a document can apply and a log can store: an import's path is
// read once and its strokes stand in the operation itself from then on.

#include <filesystem>

#include "common/base/result.h"
#include "proto/operation.pb.h"
#include "server-model/model/limits.h"

namespace handloft::model {

/// Where operations may read and write. Relative paths are relative to `folder`.
struct FileAccess {
  enum class Scope { anywhere, within_folder };
  std::filesystem::path folder = ".";
  Scope scope =
      Scope::anywhere;  ///< within_folder: absolute paths and ".." that lead out are permission_denied.

  Result<std::filesystem::path> resolve(const std::string& path) const;
};

/// For import_strokes with a path: reads the .tilt file, scales and centres the strokes, and returns the
/// operation with `resolved` filled and the path kept for people. Any other operation comes back as it is.
/// Errors: io, data_corrupt, invalid_argument (no such stroke), resource_exhausted.
Result<handloft::v1::Operation> resolve_operation(const handloft::v1::Operation& operation,
                                                  const FileAccess& files, const Limits& limits = {});

}  // namespace handloft::model
