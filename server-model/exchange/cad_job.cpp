#include "server-model/exchange/cad_job.h"

#include <utility>
#include <vector>

#include "server-model/exchange/cad_wire.h"

namespace handloft::exchange {
namespace {

using detail::WireReader;
using detail::WireWriter;

enum class Job : unsigned char { model, reference, text };

template <typename T>
std::string answer_of(const Result<T>& result) {
  WireWriter wire;
  wire(result.ok());
  if (result.ok()) {
    wire(*result);
  } else {
    wire(result.error());
  }
  return wire.take();
}

template <typename T>
Result<T> read_answer(std::string_view answer) {
  WireReader wire(answer);
  bool ok = false;
  wire(ok);
  T value;
  Error error;
  if (ok) {
    wire(value);
  } else {
    wire(error);
  }
  if (wire.failed() || !wire.at_end()) {
    return make_error(ErrorCode::internal, "the CAD kernel gave an answer that is damaged", "path");
  }
  if (!ok) return error;
  return value;
}

template <typename T, typename Perform>
std::string answer_if(const WireReader& wire, const Perform& perform) {
  if (!wire.failed() && wire.at_end()) return answer_of<T>(perform());
  return answer_of<T>(
      make_error(ErrorCode::internal, "the CAD kernel got a request that is damaged", "path"));
}

std::string perform_model(WireReader& wire) {
  std::filesystem::path path;
  CadImportOptions options;
  Duration triangles_within{};
  wire(path);
  wire(options);
  wire(triangles_within);
  return answer_if<ImportedModel>(wire,
                                  [&] { return CadKernel().import_model(path, options, triangles_within); });
}

std::string perform_reference(WireReader& wire) {
  std::filesystem::path path;
  ReferenceOptions options;
  wire(path);
  wire(options);
  return answer_if<ImportedReference>(wire, [&] { return CadKernel().import_reference(path, options); });
}

std::string perform_text(WireReader& wire) {
  CadTextFormat format{};
  std::string file_name;
  std::vector<SurfaceExport> surfaces;
  std::vector<CadFace> faces;
  std::vector<ModelExport> models;
  StepOptions options;
  wire(format);
  wire(file_name);
  wire(surfaces);
  wire(faces);
  wire(models);
  wire(options);
  return answer_if<CadText>(wire, [&] {
    return CadKernel().text(format, file_name, {surfaces, faces, models}, options);
  });
}

}  // namespace

std::string model_request(const std::filesystem::path& path, const CadImportOptions& options,
                          Duration triangles_within) {
  WireWriter wire;
  wire(Job::model);
  wire(path);
  wire(options);
  wire(triangles_within);
  return wire.take();
}

std::string reference_request(const std::filesystem::path& path, const ReferenceOptions& options) {
  WireWriter wire;
  wire(Job::reference);
  wire(path);
  wire(options);
  return wire.take();
}

std::string text_request(CadTextFormat format, const std::string& file_name, const CadContent& content,
                         const StepOptions& options) {
  WireWriter wire;
  wire(Job::text);
  wire(format);
  wire(file_name);
  wire(content.surfaces);
  wire(content.faces);
  wire(content.models);
  wire(options);
  return wire.take();
}

std::string perform_cad_job(std::string_view request) {
  WireReader wire(request);
  Job job{};
  wire(job);
  switch (job) {
    case Job::model:
      return perform_model(wire);
    case Job::reference:
      return perform_reference(wire);
    case Job::text:
      return perform_text(wire);
  }
  return answer_of<CadText>(
      make_error(ErrorCode::internal, "the CAD kernel got a request of no kind", "path"));
}

Result<ImportedModel> model_answer(std::string_view answer) {
  return read_answer<ImportedModel>(answer);
}

Result<ImportedReference> reference_answer(std::string_view answer) {
  return read_answer<ImportedReference>(answer);
}

Result<CadText> text_answer(std::string_view answer) {
  return read_answer<CadText>(answer);
}

}  // namespace handloft::exchange
