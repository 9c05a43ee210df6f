#pragma once
// The CAD kernel as those see it who only want files read and written. Open CASCADE falls over some damaged
// files (of hammer.iges with random bytes changed every tenth or so: IGESGeom_BSplineCurve::Init reads beyond
// its knots), and others keep it busy for ever. So a server lets another process do it: the session's
// CadProcess is a CadKernel too, which sends jobs (cad_job.h) there. This one works in the process itself.

#include <filesystem>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "server-model/exchange/cad_export.h"
#include "server-model/exchange/cad_import.h"
#include "server-model/exchange/reference_import.h"
#include "server-model/exchange/step_writer.h"

namespace handloft::exchange {

enum class CadTextFormat : unsigned char { step, iges };

/// What is written into a file, and the neighbours in models that came apart.
struct CadText {
  std::string text;
  std::vector<BorderGap> gaps;
};

class CadKernel {
 public:
  CadKernel() = default;
  CadKernel(const CadKernel&) = delete;
  CadKernel& operator=(const CadKernel&) = delete;
  virtual ~CadKernel() = default;

  /// As import_cad_model(). `triangles_within` takes the place of CadImportOptions::keep_going, which is not
  /// asked.
  virtual Result<ImportedModel> import_model(const std::filesystem::path& path,
                                             const CadImportOptions& options,
                                             Duration triangles_within) const;
  /// As import_reference(), of any format.
  virtual Result<ImportedReference> import_reference(const std::filesystem::path& path,
                                                     const ReferenceOptions& options) const;
  /// As step_text() and iges_text(). StepOptions::on_gap is not called.
  virtual Result<CadText> text(CadTextFormat format, const std::string& file_name, const CadContent& content,
                               const StepOptions& options) const;
};

}  // namespace handloft::exchange
