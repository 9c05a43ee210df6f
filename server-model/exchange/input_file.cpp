#include "server-model/exchange/input_file.h"

#include <fmt/format.h>

#include <system_error>

namespace handloft::exchange::detail {

namespace fs = std::filesystem;

Status check_input_file(const fs::path& path, std::size_t max_bytes) {
  std::error_code failed;
  const fs::file_status kind = fs::status(path, failed);
  if (kind.type() == fs::file_type::not_found) {
    return make_error(ErrorCode::not_found, "there is no such file", "path");
  }
  const auto size = kind.type() == fs::file_type::regular ? fs::file_size(path, failed) : 0;
  if (failed || kind.type() != fs::file_type::regular) {
    return make_error(ErrorCode::io,
                      failed ? failed.message() : "found something that is not a file, expected a file",
                      "path");
  }
  if (size > max_bytes) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found {} bytes, expected at most {}", size, max_bytes), "path");
  }
  return {};
}

}  // namespace handloft::exchange::detail
