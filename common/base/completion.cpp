#include "common/base/completion.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "common/base/manual.h"

namespace handloft {

namespace {

/// All of a table, with what every table knows besides.
std::vector<OptionFacts> all_options(const ProgramFacts& facts) {
  std::vector<OptionFacts> all = facts.options;
  all.insert(all.end(), common_options().begin(), common_options().end());
  return all;
}

/// "handloft-modeld serve": its command, and its program.
std::string command_of(const ProgramFacts& facts) {
  return facts.program.substr(facts.program.find(' ') + 1);
}
std::string program_of(const ProgramFacts& facts) {
  return facts.program.substr(0, facts.program.find(' '));
}

enum class Expected { word, file, folder };

/// What a value is, by its name as --help has it.
Expected expected_of(std::string_view value) {
  if (value.starts_with("FILE") || value == "SCRIPT" || value == "TO") return Expected::file;
  if (value == "DIR" || value == "FOLDER") return Expected::folder;
  return Expected::word;
}

std::string replaced(std::string_view text, const std::vector<std::pair<char, std::string_view>>& by) {
  std::string out;
  for (const char c : text) {
    const auto found = std::find_if(by.begin(), by.end(), [c](const auto& each) { return each.first == c; });
    if (found == by.end()) {
      out += c;
    } else {
      out += found->second;
    }
  }
  return out;
}

std::string spaced(const std::vector<std::string>& words) {
  return fmt::format("{}", fmt::join(words, " "));
}

/// As one word of bash or zsh.
std::string quoted(std::string_view text) {
  return fmt::format("'{}'", replaced(text, {{'\'', "'\\''"}}));
}
std::string quoted_for_fish(std::string_view text) {
  return fmt::format("'{}'", replaced(text, {{'\'', "\\'"}, {'\\', "\\\\"}}));
}

/// As much of a help as fits beside a word: up to the first end of a clause that is not in parentheses.
std::string brief(std::string_view help) {
  int open = 0;
  for (std::size_t i = 0; i < help.size(); ++i) {
    open += help[i] == '(' ? 1 : help[i] == ')' ? -1 : 0;
    const bool ends = help[i] == ';' || help[i] == '\n' || help.substr(i).starts_with(". ");
    if (ends && open <= 0) return std::string(help.substr(0, i));
  }
  return std::string(help);
}

// ---- bash

/// Names of its functions have no dashes.
std::string bash_function(std::string_view program) {
  std::string name = fmt::format("_{}", program);
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

std::string bash_begin(std::string_view program) {
  return fmt::format(
      "# Completion of {} for bash.\n"
      "{}() {{\n"
      "  local word=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD - 1]}} words= value=\n"
      "  # \"--flag=word\" comes as three words.\n"
      "  [[ $word != = ]] || word=\n"
      "  [[ $before != = ]] || before=${{COMP_WORDS[COMP_CWORD - 2]}}\n",
      program, bash_function(program));
}

/// Sets `words`, all that may follow, and `value`, what may follow the flag before.
std::string bash_words(const ProgramFacts& facts) {
  std::vector<std::string> words;
  std::string values;
  for (const OptionFacts& word : facts.words)
    words.insert(words.end(), word.choices.begin(), word.choices.end());
  for (const OptionFacts& option : all_options(facts)) {
    words.push_back(option.flag);
    if (!option.negation.empty()) words.push_back(option.negation);
    if (!option.choices.empty())
      values += fmt::format(" {}) value={} ;;", option.flag, quoted(spaced(option.choices)));
  }
  return fmt::format("words={}; case $before in{} esac", quoted(spaced(words)), values);
}

std::string bash_end(std::string_view program) {
  return fmt::format(
      "  mapfile -t COMPREPLY < <(compgen -W \"${{value:-$words}}\" -- \"$word\")\n"
      "  [[ -n $value || $word == -* ]] || mapfile -t -O ${{#COMPREPLY[@]}} COMPREPLY < <(compgen -f -- "
      "\"$word\")\n"
      "}}\n"
      "complete -o filenames -F {} {}\n",
      bash_function(program), program);
}

// ---- zsh

std::string zsh_begin(std::string_view program) {
  return fmt::format(
      "#compdef {0}\n"
      "# Completion of {0} for zsh: as the file _{0} in a folder of $fpath, or sourced after compinit.\n"
      "_{0}() {{\n",
      program);
}

/// What is tried for a value: _arguments' ":MESSAGE:ACTION".
std::string zsh_value(std::string_view name, const std::vector<std::string>& choices) {
  const std::string message = replaced(name, {{':', "\\:"}});
  if (!choices.empty()) return fmt::format(":{}:({})", message, fmt::join(choices, " "));
  switch (expected_of(name)) {
    case Expected::file:
      return fmt::format(":{}:_files", message);
    case Expected::folder:
      return fmt::format(":{}:_files -/", message);
    case Expected::word:
      break;
  }
  return fmt::format(":{}: ", message);
}

std::string zsh_arguments(const ProgramFacts& facts, std::string_view indent) {
  std::string out = fmt::format("{}_arguments", indent);
  const auto add = [&](const std::string& specification) {
    out += fmt::format(" \\\n{}  {}", indent, quoted(specification));
  };
  std::size_t place = 0;
  for (const OptionFacts& word : facts.words)
    add(fmt::format("{}{}{}", ++place, word.required ? "" : ":", zsh_value(word.flag, word.choices)));
  for (const OptionFacts& option : all_options(facts)) {
    const std::string help =
        fmt::format("[{}]", replaced(brief(option.help), {{']', "\\]"}, {'\\', "\\\\"}}));
    if (option.value.empty()) {
      add(option.flag + help);
      if (!option.negation.empty()) add(option.negation + help);
    } else {
      // Some may be repeated.
      add(fmt::format("*{}={}{}", option.flag, help, zsh_value(option.value, option.choices)));
    }
  }
  return out + "\n";
}

std::string zsh_end(std::string_view program) {
  return fmt::format(
      "}}\n"
      "if [[ $funcstack[1] == _{0} ]]; then\n"
      "  _{0} \"$@\"\n"
      "else\n"
      "  compdef _{0} {0}\n"
      "fi\n",
      program);
}

// ---- fish

/// `condition`: when the words are for these options; empty: always.
std::string fish_lines(const ProgramFacts& facts, std::string_view condition) {
  const std::string begin =
      fmt::format("complete -c {}{}", program_of(facts),
                  condition.empty() ? "" : fmt::format(" -n {}", quoted_for_fish(condition)));
  std::string out;
  bool takes_files = false;
  for (const OptionFacts& word : facts.words) {
    if (word.choices.empty()) {
      takes_files |= expected_of(word.flag) != Expected::word;
    } else {
      out += fmt::format("{} -a {} -d {}\n", begin, quoted_for_fish(spaced(word.choices)),
                         quoted_for_fish(word.flag));
    }
  }
  if (!takes_files) out += begin + " -f\n";
  for (const OptionFacts& option : all_options(facts)) {
    const auto add = [&](std::string_view flag, std::string_view value) {
      out += fmt::format("{} -l {}{} -d {}\n", begin, flag.substr(2), value,
                         quoted_for_fish(brief(option.help)));
    };
    std::string value;
    if (!option.choices.empty()) {
      value = fmt::format(" -x -a {}", quoted_for_fish(spaced(option.choices)));
    } else if (!option.value.empty()) {
      const Expected expected = expected_of(option.value);
      value = expected == Expected::file     ? " -r -F"
              : expected == Expected::folder ? " -x -a '(__fish_complete_directories)'"
                                             : " -x";
    }
    add(option.flag, value);
    if (!option.negation.empty()) add(option.negation, "");
  }
  return out;
}

/// What may come in place of a command.
const std::vector<std::string>& in_place_of_a_command() {
  static const std::vector<std::string> flags{"--help", "--version", "--man", "--completion"};
  return flags;
}

}  // namespace

std::string_view name_of(Shell shell) {
  switch (shell) {
    case Shell::bash:
      return "bash";
    case Shell::zsh:
      return "zsh";
    case Shell::fish:
      break;
  }
  return "fish";
}

std::string completion(Shell shell, const ProgramFacts& facts) {
  switch (shell) {
    case Shell::bash:
      return bash_begin(facts.program) + "  " + bash_words(facts) + "\n" + bash_end(facts.program);
    case Shell::zsh:
      return zsh_begin(facts.program) + zsh_arguments(facts, "  ") + zsh_end(facts.program);
    case Shell::fish:
      break;
  }
  return fmt::format("# Completion of {} for fish.\n", facts.program) + fish_lines(facts, "");
}

std::string completion_section(Shell shell, const ProgramFacts& facts) {
  const std::string command = command_of(facts);
  switch (shell) {
    case Shell::bash:
      return fmt::format("    {}) {} ;;\n", command, bash_words(facts));
    case Shell::zsh:
      return fmt::format("    {})\n{}      ;;\n", command, zsh_arguments(facts, "      "));
    case Shell::fish:
      break;
  }
  return fish_lines(facts, "__fish_seen_subcommand_from " + command);
}

std::string program_completion_begin(Shell shell, std::string_view program,
                                     const std::vector<std::pair<std::string, std::string>>& commands) {
  std::string out;
  switch (shell) {
    case Shell::bash: {
      std::vector<std::string> words;
      words.reserve(commands.size() + in_place_of_a_command().size());
      for (const auto& [name, summary] : commands) words.push_back(name);
      words.insert(words.end(), in_place_of_a_command().begin(), in_place_of_a_command().end());
      return bash_begin(program) +
             fmt::format("  [[ $COMP_CWORD != 1 ]] || words='{}'\n  case ${{COMP_WORDS[1]}} in\n",
                         fmt::join(words, " "));
    }
    case Shell::zsh: {
      out = zsh_begin(program) + "  if (( CURRENT == 2 )); then\n    local -a commands=(";
      for (const auto& [name, summary] : commands)
        out +=
            fmt::format("\n      {}", quoted(fmt::format("{}:{}", name, replaced(summary, {{':', "\\:"}}))));
      out += ")\n    _describe -t commands command commands\n";
      return out + fmt::format(
                       "    [[ $PREFIX != -* ]] || compadd -- {}\n    return\n  fi\n"
                       "  local command=$words[2]\n"
                       "  shift words\n"
                       "  (( CURRENT-- ))\n"
                       "  case $command in\n",
                       fmt::join(in_place_of_a_command(), " "));
    }
    case Shell::fish:
      break;
  }
  out = fmt::format("# Completion of {} for fish.\n", program);
  for (const auto& [name, summary] : commands)
    out += fmt::format("complete -c {} -n __fish_use_subcommand -f -a {} -d {}\n", program, name,
                       quoted_for_fish(summary));
  for (const std::string& flag : in_place_of_a_command())
    out += fmt::format("complete -c {} -n __fish_use_subcommand -l {}\n", program, flag.substr(2));
  return out;
}

std::string program_completion_end(Shell shell, std::string_view program) {
  switch (shell) {
    case Shell::bash:
      return "  esac\n" + bash_end(program);
    case Shell::zsh:
      return "  esac\n" + zsh_end(program);
    case Shell::fish:
      break;
  }
  return "";
}

Result<std::optional<Shell>> shell_asked_for(std::string_view flag, const std::vector<std::string>& words) {
  if (words.empty() || !words.front().starts_with(flag)) return std::optional<Shell>();
  std::string_view name = std::string_view(words.front()).substr(flag.size());
  if (name.starts_with("=")) {
    name.remove_prefix(1);
  } else if (!name.empty()) {
    return std::optional<Shell>();
  } else if (words.size() > 1) {
    name = words[1];
  }
  for (const Shell shell : {Shell::bash, Shell::zsh, Shell::fish}) {
    if (name == name_of(shell)) return std::optional(shell);
  }
  return make_error(ErrorCode::invalid_argument,
                    fmt::format("found \"{}\", expected bash, zsh or fish", name),
                    std::string(flag.substr(2)));
}

Result<std::optional<std::string>> completion_asked_for(const OptionTable& table,
                                                        const std::vector<std::string>& words) {
  const auto whole = shell_asked_for("--completion", words);
  if (!whole) return whole.error();
  const ProgramFacts facts = table.facts();
  if (*whole && facts.program.find(' ') != std::string::npos) {
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("expected before the command: {} --completion={}", program_of(facts), name_of(**whole)),
        "completion");
  }
  if (*whole) return std::optional(completion(**whole, facts));
  const auto section = shell_asked_for("--completion-section", words);
  if (!section) return section.error();
  if (*section) return std::optional(completion_section(**section, facts));
  return std::optional<std::string>();
}

}  // namespace handloft
