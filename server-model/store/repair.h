#pragma once
// What is good of a damaged log, in a new file beside it. The damaged one is only read.

#include <cstdint>
#include <filesystem>
#include <vector>

#include "common/base/result.h"
#include "server-model/store/log_check.h"

namespace handloft::store {

struct Repaired {
  std::uint64_t operations = 0;  ///< Kept.
  std::vector<Damage> damages;   ///< Of the damaged file.
};

/// The longest prefix of good operations, also of a file that was cut off; the audit trail where it is good.
/// Errors: those of OperationLog::open() and create(); io.
Result<Repaired> repair(const std::filesystem::path& damaged, const std::filesystem::path& to,
                        const LogOptions& options = {});

}  // namespace handloft::store
