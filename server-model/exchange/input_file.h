#pragma once
// The first look at a file that somebody wants to have read. Not for others than importers.

#include <cstddef>
#include <filesystem>

#include "common/base/result.h"

namespace handloft::exchange::detail {

/// That it is a regular file of at most `max_bytes`. Errors, with the field "path": not_found, io (no file,
/// or what the system says), resource_exhausted.
Status check_input_file(const std::filesystem::path& path, std::size_t max_bytes);

}  // namespace handloft::exchange::detail
