#pragma once
// Which build this is: the project's version from CMake, and the commit where the build knew it.

#include <string>
#include <string_view>

namespace handloft {

/// "0.1.0"
std::string_view version();
/// The commit's short hash, or empty.
std::string_view version_commit();
/// "handloft-hmd 0.1.0 (1a2b3c4)": what --version prints and what a Hello carries.
std::string program_version(std::string_view program);

}  // namespace handloft
