// handloft-modeld: the model server. `run` drives a script, `serve` serves a model to viewers and editors.

#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/completion.h"
#include "common/base/manual.h"
#include "common/base/version.h"
#include "server-model/main/access_command.h"
#include "server-model/main/cad_kernel_command.h"
#include "server-model/main/run_command.h"
#include "server-model/main/serve_command.h"
#include "server-model/main/store_command.h"

namespace {

using Words = std::vector<std::string>;

struct Command {
  const char* name;
  const char* words;    ///< What follows it, for --help.
  const char* summary;  ///< nullptr: not for people.
  std::function<int(const Words&)> run;
};

Command store_command(const char* name, const char* words, const char* summary) {
  return {name, words, summary,
          [name](const Words& rest) -> int { return handloft::model::store_command(name, rest); }};
}

Command access_command(const char* name, const char* words, const char* summary) {
  return {name, words, summary,
          [name](const Words& rest) -> int { return handloft::model::access_command(name, rest); }};
}

/// In the order of --help. Each knows --help of its own.
const std::vector<Command>& commands() {
  static const std::vector<Command> table{
      {"run", "SCRIPT", "run a script of operations, queries and expectations", handloft::model::run_command},
      {"serve", "", "serve a model to viewers and editors, and follow the hand",
       handloft::model::serve_command},
      access_command("invite", "", "print a one-time code that pairs somebody's device with the server"),
      access_command("pair", "CODE", "pair this device with a server"),
      access_command("users", "", "list users, roles and devices"),
      access_command("role", "NAME ROLE", "give a user another role"),
      access_command("revoke", "[NAME]", "shut a user or a device out"),
      access_command("audit", "", "tell who came, went, was refused, invited, paired or revoked"),
      store_command("models", "", "list the models in a folder"),
      store_command("history", "FILE", "tell what was done to a model"),
      store_command("verify", "FILE", "check a model's file"),
      store_command("repair", "FILE", "write what is good of a damaged model to another file"),
      store_command("backup", "FILE TO", "copy a model while it is worked on, and check the copy"),
      store_command("export", "FILE", "write a model, as it is or was, as STEP, IGES, GLB, OBJ or a script"),
      {"cad-kernel", "", nullptr, handloft::model::cad_kernel_command},
  };
  return table;
}

constexpr const char* program = "handloft-modeld";
constexpr const char* description = "Owns a model: points, surfaces, history.";

void print(const std::string& text, std::FILE* to = stdout) {
  std::fputs(text.c_str(), to);
}

void print_usage(std::FILE* to) {
  print(fmt::format("Usage: {} COMMAND [OPTIONS]\n\n{}\n\nCommands:\n", program, description), to);
  for (const Command& command : commands()) {
    if (command.summary == nullptr) continue;
    print(fmt::format("  {:<16}{}\n", fmt::format("{} {}", command.name, command.words), command.summary),
          to);
  }
  print(
      "\n"
      "Options:\n"
      "  --help        show this text; COMMAND --help shows the command's options\n"
      "  --version     show the version\n"
      "  --man         the manual page, for man(1)\n"
      "  --completion  =bash, =zsh or =fish: what that shell is to source\n"
      "\n"
      "Exit status: 0 done, 1 a script line or the server failed, or a file is damaged, 2 wrong usage.\n",
      to);
}

std::vector<std::pair<std::string, std::string>> summaries() {
  std::vector<std::pair<std::string, std::string>> all;
  for (const Command& command : commands()) {
    if (command.summary != nullptr) all.emplace_back(command.name, command.summary);
  }
  return all;
}

/// What each command says of itself to that word.
void print_of_commands(const std::string& asked) {
  for (const Command& command : commands()) {
    if (command.summary != nullptr) (void)command.run({asked});
  }
}

int print_manual() {
  print(handloft::program_man_begin(program, description, summaries()));
  print_of_commands("--man-section");
  print(handloft::program_man_end());
  return handloft::model::exit_ok;
}

int print_completion(handloft::Shell shell) {
  print(handloft::program_completion_begin(shell, program, summaries()));
  print_of_commands(fmt::format("--completion-section={}", handloft::name_of(shell)));
  print(handloft::program_completion_end(shell, program));
  return handloft::model::exit_ok;
}

int run(const Words& words) {
  const std::string first = words.empty() ? "" : words.front();
  if (first == "--help" || first == "-h") {
    print_usage(stdout);
    return handloft::model::exit_ok;
  }
  if (first == "--version") {
    print(handloft::program_version(program) + "\n");
    return handloft::model::exit_ok;
  }
  if (first == "--man") return print_manual();
  const auto shell = handloft::shell_asked_for("--completion", words);
  if (!shell) {
    print(fmt::format("handloft-modeld: {}\n", shell.error().describe()), stderr);
    return handloft::model::exit_usage;
  }
  if (*shell) return print_completion(**shell);
  for (const Command& command : commands()) {
    if (first == command.name) return command.run({words.begin() + 1, words.end()});
  }
  if (!first.empty()) print(fmt::format("handloft-modeld: there is no command \"{}\"\n\n", first), stderr);
  print_usage(stderr);
  return handloft::model::exit_usage;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run({argv + 1, argv + argc});
  } catch (const std::exception& problem) {
    std::fprintf(stderr, "handloft-modeld: %s\n", problem.what());
    return handloft::model::exit_failed;
  }
}
