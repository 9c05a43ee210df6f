#pragma once
// A program's manual page (man(7)), from the same table as its flags and --help (config.h), so that nothing
// of it can be forgotten.
//
//   PROGRAM --man    the page
//
// It is known to every OptionTable and made at build time. A program of several commands puts the pieces of
// theirs together: program_man_begin(), COMMAND --man-section of each, program_man_end().

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
/// What every table knows besides its own.
const std::vector<OptionFacts>& common_options();

/// The page of a program of several commands: this, the section of each command, then program_man_end().
std::string program_man_begin(std::string_view program, std::string_view description,
                              const std::vector<std::pair<std::string, std::string>>& commands);
std::string program_man_end();

/// What the first of the words asks for of the above; nullopt: none.
std::optional<std::string> manual_asked_for(const OptionTable& table, const std::vector<std::string>& words);

}  // namespace handloft
