#include "server-model/exchange/cad_file.h"

#include <fmt/format.h>

#include <locale>
#include <span>
#include <sstream>
#include <string_view>
#include <utility>

#include "server-model/exchange/atomic_file.h"
#include "server-model/exchange/occt_face.h"
#include "server-model/exchange/occt_replace.h"
#include "server-model/exchange/occt_session.h"
#include "server-model/exchange/occt_trimmed_face.h"

namespace handloft::exchange::detail {

namespace {

using Add = std::function<Status(const NamedShape& shape)>;

/// `make` sets shape and parts of what it is given.
template <typename Item, typename Make>
Status add_each(std::span<const Item> items, const char* list, const Make& make, const Add& add) {
  for (std::size_t i = 0; i < items.size(); ++i) {
    NamedShape named{items[i].name, {}, fmt::format("{}[{}]", list, i), {}};
    if (const Status made = make(items[i], i, named); !made) {
      Error error = made.error();
      error.field = named.field + (error.field.empty() ? "" : "." + error.field);
      return error;
    }
    if (Status added = add(named); !added) return added;
  }
  return {};
}

Status set(NamedShape& named, const Result<TopoDS_Face>& face) {
  if (!face) return face.error();
  named.shape = *face;
  return {};
}

}  // namespace

Status for_each_shape(const CadContent& content, const StepOptions& options, const Add& add) {
  Status status = add_each(
      content.surfaces, "surfaces",
      [&](const SurfaceExport& surface, std::size_t, NamedShape& named) {
        return set(named, make_face(surface, options.contour_tolerance));
      },
      add);
  if (!status) return status;
  const CadPlacement millimetres;
  status = add_each(
      content.faces, "faces",
      [&](const CadFace& face, std::size_t, NamedShape& named) {
        return set(named, make_face(face, millimetres));
      },
      add);
  if (!status) return status;
  return add_each(
      content.models, "models",
      [&](const ModelExport& model, std::size_t index, NamedShape& named) -> Status {
        auto made = make_model(model);
        if (!made) return made.error();
        named.shape = made->shape;
        named.parts = std::move(made->parts);
        for (BorderGap& gap : made->gaps) {
          gap.model = index;
          if (options.on_gap) options.on_gap(gap);
        }
        return {};
      },
      add);
}

Result<std::string> printed(const std::function<bool(std::ostream&)>& print) {
  std::ostringstream stream;
  stream.imbue(std::locale::classic());
  if (!print(stream) || !stream) {
    return make_error(ErrorCode::internal, "the CAD kernel didn't print the file", "surfaces");
  }
  return std::move(stream).str();
}

Result<std::string> make_cad_text(const CadContent& content, const StepOptions& options, const char* doing,
                                  const std::function<Result<std::string>()>& to_text) {
  if (content.surfaces.empty() && content.faces.empty() && content.models.empty()) {
    return make_error(ErrorCode::invalid_argument, "found nothing to export, expected a surface", "surfaces");
  }
  if (!(options.contour_tolerance >= 1e-9 && options.contour_tolerance <= 1e-2)) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected 1e-9..1e-2", options.contour_tolerance),
                      "contour_tolerance");
  }
  std::string text;
  const OcctSession session;
  const Status made = guarded(doing, [&]() -> Status {
    Result<std::string> result = to_text();
    if (!result.ok()) return result.error();
    text = std::move(*result);
    return {};
  });
  if (!made.ok()) return made.error();
  return text;
}

Status write_cad_text(const std::filesystem::path& path, const Result<std::string>& text) {
  if (!text) return text.error();
  return write_file_atomically(path, std::string_view(*text));
}

}  // namespace handloft::exchange::detail
