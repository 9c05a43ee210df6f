#pragma once
// Expected failure as a value: what the world can do to us (a bad file, a hostile packet, an unplugged
// device). Programming errors are assertions; exceptions only at start-up.

#include <cassert>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

namespace handloft {

enum class ErrorCode {
  invalid_argument,     ///< A field holds something that it may not: NaN, out of range, malformed.
  not_found,            ///< A named thing (entity, file, device) does not exist.
  already_exists,       ///< A name is taken.
  failed_precondition,  ///< The request is fine, but not in this state (nothing to undo, not fitted).
  rank_deficient,       ///< Too few or degenerate points for a fit (A7).
  resource_exhausted,   ///< A limit was exceeded: frame size, memory, connections.
  unsupported,          ///< A version, format or feature that this build doesn't know.
  permission_denied,    ///< The peer or user may not do this.
  io,                   ///< The operating system refused: full disk, lost device, broken pipe.
  data_corrupt,         ///< A checksum or structure is wrong.
  cancelled,            ///< Ended on request.
  timeout,              ///< Took longer than allowed.
  internal,             ///< Our own fault; please report.
};

/// Stable lower-case name, as it stands in answers on the wire and in scripts ("invalid_argument").
std::string_view to_string(ErrorCode code);

/// What failed, in words for a person: the message says what was found and what was expected; `field` is the
/// path of the offending field ("points[3].position.x", "cameras.left.fps"), empty when there is none.
struct Error {
  ErrorCode code = ErrorCode::internal;
  std::string message;
  std::string field;

  /// "invalid_argument: points[3].pressure: found 1.7, expected 0..1".
  std::string describe() const;
};

inline Error make_error(ErrorCode code, std::string message, std::string field = {}) {
  return Error{code, std::move(message), std::move(field)};
}

/// A value or an Error. Converts from both, so that `return value;` and `return make_error(...);` work.
template <typename T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}
  Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}

  bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }

  /// Preconditions: ok().
  T& value() & {
    assert(ok());
    return *std::get_if<0>(&state_);
  }
  const T& value() const& {
    assert(ok());
    return *std::get_if<0>(&state_);
  }
  T&& value() && {
    assert(ok());
    return std::move(*std::get_if<0>(&state_));
  }
  T& operator*() & { return value(); }
  const T& operator*() const& { return value(); }
  T&& operator*() && { return std::move(*this).value(); }
  T* operator->() { return &value(); }
  const T* operator->() const { return &value(); }

  /// Preconditions: !ok().
  const Error& error() const {
    assert(!ok());
    return *std::get_if<1>(&state_);
  }

 private:
  std::variant<T, Error> state_;
};

/// Success or an Error: a Result with no value.
template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Error error) : error_(std::move(error)) {}

  bool ok() const { return !error_.has_value(); }
  explicit operator bool() const { return ok(); }
  const Error& error() const {
    assert(!ok());
    return *error_;
  }

 private:
  std::optional<Error> error_;
};

using Status = Result<void>;

}  // namespace handloft
