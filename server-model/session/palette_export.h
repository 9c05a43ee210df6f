#pragma once
// The palette's "Export": a hand names no file, so the session does.

#include <filesystem>
#include <memory>

#include "common/base/result.h"
#include "server-model/session/export.h"

namespace handloft::model {

/// All fitted shapes of the present alternative to "NAME-N.step" in `folder`: NAME is the alternative's, with
/// '_' for what does not belong into a file's name; N counts from 1 and is the first that is free, so that
/// nothing is overwritten. `cad` as FileAccess::cad. Errors: as export_document(); resource_exhausted when
/// ten thousand are taken.
Result<Exported> export_from_palette(const Document& document, const std::filesystem::path& folder,
                                     std::shared_ptr<const exchange::CadKernel> cad = nullptr);

}  // namespace handloft::model
