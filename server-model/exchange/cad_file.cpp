#include "server-model/exchange/cad_file.h"

#include <fmt/format.h>

#include <locale>
#include <span>
#include <sstream>
#include <string_view>

#include "server-model/exchange/atomic_file.h"
#include "server-model/exchange/occt_face.h"
#include "server-model/exchange/occt_replace.h"
#include "server-model/exchange/occt_session.h"
#include "server-model/exchange/occt_trimmed_face.h"

namespace handloft::exchange::detail {

namespace {

using Add =
    std::function<Status(const std::string& name, const TopoDS_Shape& shape, const std::string& field)>;

template <typename Item, typename Make>
Status add_each(std::span<const Item> items, const char* list, const Make& make, const Add& add) {
  for (std::size_t i = 0; i < items.size(); ++i) {
    const std::string field = fmt::format("{}[{}]", list, i);
    const auto shape = make(items[i]);
    if (!shape.ok()) {
      Error error = shape.error();
      error.field = field + (error.field.empty() ? "" : "." + error.field);
      return error;
    }
    if (Status added = add(items[i].name, *shape, field); !added) return added;
  }
  return {};
}

}  // namespace

Status for_each_shape(const CadContent& content, double contour_tolerance, const Add& add) {
  Status status = add_each(
      content.surfaces, "surfaces",
      [&](const SurfaceExport& surface) { return make_face(surface, contour_tolerance); }, add);
  if (!status) return status;
  const CadPlacement millimetres;
  status = add_each(
      content.faces, "faces", [&](const CadFace& face) { return make_face(face, millimetres); }, add);
  if (!status) return status;
  return add_each(content.models, "models", make_model, add);
}

Result<std::string> printed(const std::function<bool(std::ostream&)>& print) {
  std::ostringstream stream;
  stream.imbue(std::locale::classic());
  if (!print(stream) || !stream) {
    return make_error(ErrorCode::internal, "the CAD kernel didn't print the file", "surfaces");
  }
  return std::move(stream).str();
}

Status write_cad_file(const std::filesystem::path& path, const CadContent& content,
                      const StepOptions& options, const char* doing,
                      const std::function<Result<std::string>(const std::string& file_name)>& to_text) {
  if (content.surfaces.empty() && content.faces.empty() && content.models.empty()) {
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
