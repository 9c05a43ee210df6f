#pragma once
// Completion of a program's command line for bash, zsh and fish, from the same table as its flags, --help and
// manual page (config.h, manual.h), so that none of them can be forgotten.
//
//   PROGRAM --completion=SHELL    what the shell is to source
//
// It is known to every OptionTable. A program of several commands puts the pieces of theirs together: the
// begin, COMMAND --completion-section=SHELL of each, the end.

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/config.h"
#include "common/base/result.h"

namespace handloft {

enum class Shell { bash, zsh, fish };
std::string_view name_of(Shell shell);

/// Completion of a program without commands.
std::string completion(Shell shell, const ProgramFacts& facts);
/// One command's piece; `facts.program` is "PROGRAM COMMAND".
std::string completion_section(Shell shell, const ProgramFacts& facts);
/// Before the pieces and after them; each command with what it is for.
std::string program_completion_begin(Shell shell, std::string_view program,
                                     const std::vector<std::pair<std::string, std::string>>& commands);
std::string program_completion_end(Shell shell, std::string_view program);

/// Which shell the first of the words asks for by `flag` ("--completion=zsh" or "--completion" "zsh");
/// nullopt: they ask for something else. invalid_argument: for none of ours.
Result<std::optional<Shell>> shell_asked_for(std::string_view flag, const std::vector<std::string>& words);

/// What the first of the words asks for of the above; nullopt: none. invalid_argument as above, and for the
/// whole of a program from one of its commands.
Result<std::optional<std::string>> completion_asked_for(const OptionTable& table,
                                                        const std::vector<std::string>& words);

}  // namespace handloft
