#pragma once
// A copy of a model's file as it is at one moment, while a server may be writing it (issue 7, part 6). The
// copy is checked whole before it gets its name.

#include <cstdint>
#include <filesystem>

#include "common/base/result.h"

namespace handloft::store {

struct Backup {
  std::uint64_t operations = 0;  ///< All of them checked.
  std::uint64_t bytes = 0;
};

/// Writes `to` + ".part", flushes and checks it (log_check.h), then gives it its name. Nothing of `model` is
/// changed, and nobody who writes it waits. Errors: already_exists for `to`; those of opening `model`;
/// data_corrupt when what it holds is damaged, naming it (repair.h can help); io, resource_exhausted. Then
/// there is no `to`.
Result<Backup> back_up(const std::filesystem::path& model, const std::filesystem::path& to);

}  // namespace handloft::store
