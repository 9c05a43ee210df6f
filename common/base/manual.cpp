#include "common/base/manual.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "common/base/version.h"

namespace handloft {

namespace {

/// Text in a page: no character of it is a command.
std::string roff(std::string_view text) {
  std::string out;
  bool line_begins = true;
  for (const char c : text) {
    if (line_begins && (c == '.' || c == '\'')) out += "\\&";
    line_begins = c == '\n';
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else {
      out += c;
    }
  }
  return out;
}

std::string upper(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(),
                 [](char c) { return static_cast<char>(std::toupper(static_cast<unsigned char>(c))); });
  return out;
}

std::string first_sentence(std::string_view text) {
  std::string sentence(text.substr(0, text.find_first_of(".\n")));
  if (!sentence.empty())
    sentence[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(sentence[0])));
  return sentence;
}

std::string head(std::string_view program, std::string_view description) {
  return fmt::format(".TH {} 1 \"\" \"handloft {}\" \"Handloft\"\n.SH NAME\n{} \\- {}\n",
                     roff(upper(program)), roff(version()), roff(program), roff(first_sentence(description)));
}

std::string described(const OptionFacts& option) {
  std::string out = fmt::format(".TP\n\\fB{}\\fR", roff(option.flag));
  if (!option.negation.empty()) out += fmt::format(", \\fB{}\\fR", roff(option.negation));
  if (!option.value.empty()) out += fmt::format(" \\fI{}\\fR", roff(option.value));
  out += "\n" + roff(option.help);
  if (!option.preset.empty()) out += fmt::format(" (default: {})", roff(option.preset));
  return out + "\n";
}

std::string all_described(const ProgramFacts& facts) {
  std::string out;
  for (const OptionFacts& word : facts.words) out += described(word);
  for (const OptionFacts& option : facts.options) out += described(option);
  return out;
}

std::string synopsis(const ProgramFacts& facts) {
  std::string out = fmt::format("\\fB{}\\fR [\\fIOPTIONS\\fR]", roff(facts.program));
  for (const OptionFacts& word : facts.words)
    out += fmt::format(fmt::runtime(word.required ? " \\fI{}\\fR" : " [\\fI{}\\fR]"), roff(word.flag));
  return out + "\n";
}

std::string files_and_status() {
  return ".SH EXIT STATUS\n0 done, 1 it failed, 2 the command line or the configuration is wrong.\n"
         ".SH ENVIRONMENT\n.TP\nXDG_RUNTIME_DIR\nThe sockets of this user lie in its folder "
         "\\fIhandloft\\fR.\n"
         ".TP\nXDG_CONFIG_HOME, XDG_STATE_HOME\nServers that this user is paired with, and users of a server "
         "of this user, lie in the folders \\fIhandloft\\fR there.\n"
         ".SH SEE ALSO\n\\fBhandloft\\-modeld\\fR(1), \\fBhandloft\\-trackd\\fR(1), "
         "\\fBhandloft\\-hmd\\fR(1)\n";
}

}  // namespace

const std::vector<OptionFacts>& common_options() {
  static const std::vector<OptionFacts> options{
      {"--help", "", "", {}, "Print what options there are and end", ""},
      {"--version", "", "", {}, "Print the version and end", ""},
      {"--config", "", "FILE", {}, "Read options from this TOML file; flags win over it", ""},
      {"--man", "", "", {}, "Print this page for man(1) and end", ""},
      {"--completion",
       "",
       "SHELL",
       {"bash", "zsh", "fish"},
       "Print completion for bash, zsh or fish and end",
       ""}};
  return options;
}

std::string manual_page(const ProgramFacts& facts) {
  std::string out = head(facts.program, facts.description);
  out += ".SH SYNOPSIS\n" + synopsis(facts) + ".SH DESCRIPTION\n" + roff(facts.description) + "\n";
  out += ".SH OPTIONS\n" + all_described(facts);
  for (const OptionFacts& option : common_options()) out += described(option);
  return out + files_and_status();
}

std::string manual_section(const ProgramFacts& facts) {
  return fmt::format(".SS {}\n{}.PP\n{}\n{}", roff(facts.program), synopsis(facts), roff(facts.description),
                     all_described(facts));
}

std::string program_man_begin(std::string_view program, std::string_view description,
                              const std::vector<std::pair<std::string, std::string>>& commands) {
  std::string out = head(program, description);
  out += fmt::format(".SH SYNOPSIS\n\\fB{}\\fR \\fICOMMAND\\fR [\\fIOPTIONS\\fR]\n.SH DESCRIPTION\n{}\n",
                     roff(program), roff(description));
  out += ".SH COMMANDS\n";
  for (const auto& [name, summary] : commands)
    out += fmt::format(".TP\n\\fB{}\\fR\n{}\n", roff(name), roff(summary));
  return out + ".SH OPTIONS\n";
}

std::string program_man_end() {
  std::string out = ".SS All commands\n";
  for (const OptionFacts& option : common_options()) out += described(option);
  return out + files_and_status();
}

std::optional<std::string> manual_asked_for(const OptionTable& table, const std::vector<std::string>& words) {
  if (words.empty()) return std::nullopt;
  const std::string& first = words.front();
  if (first == "--man") return manual_page(table.facts());
  if (first == "--man-section") return manual_section(table.facts());
  return std::nullopt;
}

}  // namespace handloft
