#include "common/base/version.h"

namespace handloft {

std::string_view version() {
  return HANDLOFT_VERSION;
}

std::string_view version_commit() {
  return HANDLOFT_COMMIT;
}

std::string program_version(std::string_view program) {
  std::string text(program);
  text.append(" ").append(version());
  if (!version_commit().empty()) text.append(" (").append(version_commit()).append(")");
  return text;
}

}  // namespace handloft
