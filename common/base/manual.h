#pragma once
// A program's manual page (man(7)) and its completion for bash, from the same table as its flags and --help
// (config.h), so that none of them can be forgotten.
//
//   PROGRAM --man                the page
//   PROGRAM --completion=bash    what bash is to source
//
// Both are known to every OptionTable and made at build time. A program of several commands puts the pieces
// of theirs together, COMMAND --man-section and COMMAND --completion-words: program_man_begin() and the like.

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/config.h"

namespace handloft {

/// The page of a program without commands.
std::string manual_page(const ProgramFacts& facts);
/// One command's part of a page.
std::string manual_section(const ProgramFacts& facts);
/// Completion of a program without commands.
std::string bash_completion(const ProgramFacts& facts);
/// All words that may follow a command, in one line.
std::string completion_words(const ProgramFacts& facts);

/// The page of a program of several commands: this, the section of each command, then program_man_end().
std::string program_man_begin(std::string_view program, std::string_view description,
                              const std::vector<std::pair<std::string, std::string>>& commands);
std::string program_man_end();
/// The same for completion: this, then for each command "    NAME) words='" its words "' ;;\n", then the end.
std::string program_completion_begin(std::string_view program);
std::string program_completion_end(std::string_view program, const std::vector<std::string>& commands);

/// What the first of the words asks for of the above; nullopt: none.
std::optional<std::string> manual_asked_for(const OptionTable& table, const std::vector<std::string>& words);

}  // namespace handloft
