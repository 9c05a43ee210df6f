#include "common/base/result.h"

namespace handloft {

std::string_view to_string(ErrorCode code) {
  switch (code) {
    case ErrorCode::invalid_argument:
      return "invalid_argument";
    case ErrorCode::not_found:
      return "not_found";
    case ErrorCode::already_exists:
      return "already_exists";
    case ErrorCode::failed_precondition:
      return "failed_precondition";
    case ErrorCode::rank_deficient:
      return "rank_deficient";
    case ErrorCode::resource_exhausted:
      return "resource_exhausted";
    case ErrorCode::unsupported:
      return "unsupported";
    case ErrorCode::permission_denied:
      return "permission_denied";
    case ErrorCode::io:
      return "io";
    case ErrorCode::data_corrupt:
      return "data_corrupt";
    case ErrorCode::cancelled:
      return "cancelled";
    case ErrorCode::timeout:
      return "timeout";
    case ErrorCode::internal:
      return "internal";
  }
  return "internal";
}

std::string Error::describe() const {
  std::string text(to_string(code));
  if (!field.empty()) text.append(": ").append(field);
  return text.append(": ").append(message);
}

}  // namespace handloft
