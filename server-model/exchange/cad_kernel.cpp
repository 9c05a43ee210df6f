#include "server-model/exchange/cad_kernel.h"

#include <utility>

#include "server-model/exchange/iges_writer.h"

namespace handloft::exchange {

Result<ImportedModel> CadKernel::import_model(const std::filesystem::path& path,
                                              const CadImportOptions& options,
                                              Duration triangles_within) const {
  const SystemClock clock;
  CadImportOptions timed = options;
  timed.keep_going = [&, begun = clock.now()] { return clock.now() - begun < triangles_within; };
  return import_cad_model(path, timed);
}

Result<ImportedReference> CadKernel::import_reference(const std::filesystem::path& path,
                                                      const ReferenceOptions& options) const {
  return exchange::import_reference(path, options);
}

Result<CadText> CadKernel::text(CadTextFormat format, const std::string& file_name, const CadContent& content,
                                const StepOptions& options) const {
  CadText result;
  StepOptions telling = options;
  telling.on_gap = [&](const BorderGap& gap) { result.gaps.push_back(gap); };
  auto made = format == CadTextFormat::iges ? iges_text(file_name, content, telling)
                                            : step_text(file_name, content, telling);
  if (!made) return made.error();
  result.text = std::move(*made);
  return result;
}

}  // namespace handloft::exchange
