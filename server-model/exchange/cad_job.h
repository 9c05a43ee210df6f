#pragma once
// What a process beside ours does for us with the CAD kernel, as bytes: requests that are encoded here and
// decoded there, and answers the other way. Both ends are the same program on the same machine, so the bytes
// have no version and numbers stand as the machine has them. Answers are not trusted, though: a kernel that
// ran over its memory may have written anything. Lists take no more memory than a small multiple of the
// bytes that came.
//
// An answer's values are bounded and well formed by their types; what they mean is checked where all
// operations are (model/operations/import_model.cpp).

#include <filesystem>
#include <string>
#include <string_view>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "server-model/exchange/cad_kernel.h"

namespace handloft::exchange {

std::string model_request(const std::filesystem::path& path, const CadImportOptions& options,
                          Duration triangles_within);
std::string reference_request(const std::filesystem::path& path, const ReferenceOptions& options);
std::string text_request(CadTextFormat format, const std::string& file_name, const CadContent& content,
                         const StepOptions& options);

/// Does in this process what a request asks for. May fall over it.
std::string perform_cad_job(std::string_view request);

/// What an answer holds, its Error too. Errors besides: internal (it is no such answer).
Result<ImportedModel> model_answer(std::string_view answer);
Result<ImportedReference> reference_answer(std::string_view answer);
Result<CadText> text_answer(std::string_view answer);

}  // namespace handloft::exchange
