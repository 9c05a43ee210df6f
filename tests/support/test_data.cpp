#include "tests/support/test_data.h"

#include <unistd.h>

#include <cstdlib>
#include <stdexcept>
#include <string>

namespace handloft::test {

namespace fs = std::filesystem;

std::optional<fs::path> recording(std::string_view relative_path) {
  const char* from_environment = std::getenv("HANDLOFT_DATA");
  const fs::path folder =
      from_environment != nullptr ? fs::path(from_environment) : fs::path("../shared/data");
  fs::path file = folder / relative_path;
  std::error_code ignored;
  if (!fs::exists(file, ignored)) return std::nullopt;
  return fs::absolute(file);
}

TemporaryDirectory::TemporaryDirectory() {
  std::string pattern = (fs::temp_directory_path() / "handloft-test-XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("cannot make a temporary folder");
  path_ = pattern;
}

TemporaryDirectory::~TemporaryDirectory() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

}  // namespace handloft::test
