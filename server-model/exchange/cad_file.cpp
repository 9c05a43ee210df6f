#include "server-model/exchange/cad_file.h"

#include <fmt/format.h>

#include <locale>
#include <sstream>
#include <string_view>

#include "server-model/exchange/atomic_file.h"
#include "server-model/exchange/occt_face.h"
#include "server-model/exchange/occt_session.h"

namespace handloft::exchange::detail {

Status for_each_face(
    std::span<const SurfaceExport> surfaces, double contour_tolerance,
    const std::function<Status(const SurfaceExport&, const TopoDS_Face&, const std::string& field)>& add) {
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    const std::string field = fmt::format("surfaces[{}]", i);
    const Result<TopoDS_Face> face = make_face(surfaces[i], contour_tolerance);
    if (!face.ok()) {
      Error error = face.error();
      error.field = field + (error.field.empty() ? "" : "." + error.field);
      return error;
    }
    if (Status added = add(surfaces[i], *face, field); !added) return added;
  }
  return {};
}

Result<std::string> printed(const std::function<bool(std::ostream&)>& print) {
  std::ostringstream stream;
  stream.imbue(std::locale::classic());
  if (!print(stream) || !stream) {
    return make_error(ErrorCode::internal, "the CAD kernel didn't print the file", "surfaces");
  }
  return std::move(stream).str();
}

Status write_cad_file(const std::filesystem::path& path, std::span<const SurfaceExport> surfaces,
                      const StepOptions& options, const char* doing,
                      const std::function<Result<std::string>(const std::string& file_name)>& to_text) {
  if (surfaces.empty()) {
    return make_error(ErrorCode::invalid_argument, "found nothing to export, expected a surface", "surfaces");
  }
  if (!(options.contour_tolerance >= 1e-9 && options.contour_tolerance <= 1e-2)) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected 1e-9..1e-2", options.contour_tolerance),
                      "contour_tolerance");
  }
  std::string text;
  Status made = [&]() -> Status {
    const OcctSession session;
    return guarded(doing, [&]() -> Status {
      Result<std::string> result = to_text(path.filename().string());
      if (!result.ok()) return result.error();
      text = std::move(*result);
      return {};
    });
  }();
  if (!made.ok()) return made;
  return write_file_atomically(path, std::string_view(text));
}

}  // namespace handloft::exchange::detail
