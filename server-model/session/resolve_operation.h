#pragma once
// Operations that touch files, made into what a document can apply and a log can store: an import's path is
// read once and its strokes or triangles stand in the operation itself from then on.

#include <filesystem>
#include <memory>
#include <string>

#include "common/base/result.h"
#include "proto/operation.pb.h"
#include "server-model/exchange/cad_kernel.h"
#include "server-model/model/limits.h"

namespace handloft::model {

/// Where operations may read and write, and by what.
struct FileAccess {
  enum class Scope { anywhere, within_folders };
  std::filesystem::path read_folder = ".";   ///< Relative paths of imports start here.
  std::filesystem::path write_folder = ".";  ///< Relative paths of exports start here.
  /// within_folders: absolute paths, and ".." or links that lead out, are permission_denied. So are exports
  /// whose names don't end as what is written: what lies beside them is not to be written over.
  Scope scope = Scope::anywhere;
  /// Reads and writes CAD files. None: this process does, which damaged ones may bring down; servers have
  /// session/cad_process.h.
  std::shared_ptr<const exchange::CadKernel> cad;
  /// Files with what SQLite and the store keep beside them, and folders with all that is in them, that no
  /// export may write over, whoever asks: those of the server's own.
  std::vector<std::filesystem::path> own;

  Result<std::filesystem::path> to_read(const std::string& path, const std::string& field) const;
  /// Errors: as above; permission_denied for what is in `own`.
  Result<std::filesystem::path> to_write(const std::string& path, const std::string& field) const;
  const exchange::CadKernel& cad_kernel() const;
};

/// For import_reference with a path: reads the file (exchange::import_reference) and returns the operation
/// with `resolved` filled, in the world, and path and placement taken out.
///
/// For import_model with a path: reads the file (exchange::import_cad_model) and returns the operation with
/// `resolved` filled and the path taken out. One that comes with `resolved` is permission_denied unless files
/// may be anywhere: the CAD kernel trusts a stored model's bytes, so only our own log and our own scripts may
/// bring them.
///
/// For import_strokes with a path: reads the .tilt file, scales and centres the strokes, and returns the
/// operation with `resolved` filled and the path taken out, so that it means the same everywhere. Any other
/// operation comes back as it is. Errors: not_found, io, data_corrupt, permission_denied, invalid_argument
/// (no path and no strokes, no such stroke, a bad scale), resource_exhausted. What is wrong inside of the
/// file has the field import_strokes.path, and its place in the file begins the message.
Result<handloft::v1::Operation> resolve_operation(const handloft::v1::Operation& operation,
                                                  const FileAccess& files, const Limits& limits = {});

}  // namespace handloft::model
