#include "server-model/session/palette_export.h"

#include <fmt/format.h>

#include <string>
#include <system_error>
#include <utility>

namespace handloft::model {

namespace fs = std::filesystem;
namespace v1 = handloft::v1;

namespace {

constexpr int max_number = 10'000;
constexpr std::size_t max_name_bytes = 64;

bool plain(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
}

std::string file_name_of(const std::string& alternative) {
  std::string name = alternative.substr(0, max_name_bytes);
  for (char& c : name) {
    if (!plain(c)) c = '_';
  }
  return name;
}

}  // namespace

Result<Exported> export_from_palette(const Document& document, const fs::path& folder,
                                     std::shared_ptr<const exchange::CadKernel> cad) {
  const std::string name = file_name_of(document.present_alternative());
  for (int number = 1; number <= max_number; ++number) {
    const std::string file = fmt::format("{}-{}.step", name, number);
    std::error_code error;
    if (fs::exists(fs::symlink_status(folder / file, error))) continue;
    v1::Export request;
    request.set_path(file);
    FileAccess files;
    files.write_folder = folder;
    files.cad = std::move(cad);
    return export_document(document, request, files);
  }
  return make_error(
      ErrorCode::resource_exhausted,
      fmt::format("\"{}\" holds {} exports of \"{}\" already", folder.string(), max_number, name),
      "export.path");
}

}  // namespace handloft::model
