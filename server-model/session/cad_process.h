#pragma once
// The CAD kernel in a process beside ours, one for each job: what it falls over, never ends or takes all
// memory for is an Error with the file's name, and the model lives. `handloft-modeld` is that process too
// (main/cad_kernel_command.h). To start it takes 25 to 60 ms.

#include <cstddef>
#include <filesystem>
#include <string>

#include "common/base/clock.h"
#include "common/base/result.h"
#include "server-model/exchange/cad_kernel.h"

namespace handloft::session {

struct CadProcessOptions {
  std::filesystem::path program = "/proc/self/exe";  ///< handloft-modeld.
  /// Of its address space: half of what a machine with 8 GB has.
  std::size_t max_memory_bytes = std::size_t{4} << 30U;
  /// Whole seconds. Files of a megabyte or two take a few; those of 128 MB, the largest, may take a hundred.
  Duration max_cpu = std::chrono::minutes(3);
  Duration max_time = std::chrono::minutes(5);           ///< On the wall: the machine has other work as well.
  std::size_t max_answer_bytes = std::size_t{1} << 30U;  ///< Four times the largest stored model.
};

class CadProcess final : public exchange::CadKernel {
 public:
  explicit CadProcess(CadProcessOptions options = {}) : options_(std::move(options)) {}

  /// Errors besides those of CadKernel: data_corrupt (the kernel ended by a signal, which one is told),
  /// resource_exhausted (memory or CPU time), timeout (wall clock), io (no process could be started).
  Result<exchange::ImportedModel> import_model(const std::filesystem::path& path,
                                               const exchange::CadImportOptions& options,
                                               Duration triangles_within) const override;
  /// The mesh formats have readers of our own and are read in this process.
  Result<exchange::ImportedReference> import_reference(
      const std::filesystem::path& path, const exchange::ReferenceOptions& options) const override;
  Result<exchange::CadText> text(exchange::CadTextFormat format, const std::string& file_name,
                                 const exchange::CadContent& content,
                                 const exchange::StepOptions& options) const override;

 private:
  Result<std::string> perform(const std::string& request) const;

  CadProcessOptions options_;
};

}  // namespace handloft::session
