#pragma once
// A file that is either the old one or the new one, whole, whatever fails: the content goes to a temporary
// name in the same folder, is flushed to the disk (fsync) and then takes the final name (rename).

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <string_view>

#include "common/base/result.h"

namespace handloft::exchange {

/// Replaces or creates `path`. Errors: io with the path and the system's reason (full disk, read-only, no
/// such folder); then the old file is intact and the temporary one removed.
Status write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> content);
Status write_file_atomically(const std::filesystem::path& path, std::string_view content);

/// The same for a library that writes by file name: `write` gets the temporary name and fills it.
Status write_file_atomically(const std::filesystem::path& path,
                             const std::function<Status(const std::filesystem::path& temporary)>& write);

}  // namespace handloft::exchange
