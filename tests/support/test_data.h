#pragma once
// Where tests find the real recordings that are not part of the repository.

#include <filesystem>
#include <optional>
#include <string_view>

namespace handloft::test {

/// The path of a recording below $HANDLOFT_DATA, or below ../shared/data beside the checkout; nullopt when it
/// is not there, in which case the test says so and skips (see HANDLOFT_REQUIRE_DATA).
std::optional<std::filesystem::path> recording(std::string_view relative_path);

/// A fresh empty folder, removed again with the object.
class TemporaryDirectory {
 public:
  TemporaryDirectory();
  ~TemporaryDirectory();
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace handloft::test

/// Binds `variable` to the path of a recording, or skips the test saying which file is missing.
#define HANDLOFT_REQUIRE_DATA(variable, relative_path)                             \
  const auto variable##_found = ::handloft::test::recording(relative_path);        \
  if (!variable##_found)                                                           \
    GTEST_SKIP() << "recording " << (relative_path) << " is not on this machine; " \
                 << "set HANDLOFT_DATA to the folder that holds it";               \
  const std::filesystem::path& variable = *variable##_found
