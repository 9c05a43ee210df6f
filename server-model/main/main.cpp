// handloft-modeld: the model server. `run` drives a script, `serve` serves a model to viewers and editors.

#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "common/base/version.h"
#include "server-model/main/cad_kernel_command.h"
#include "server-model/main/run_command.h"
#include "server-model/main/serve_command.h"
#include "server-model/main/store_command.h"

namespace {

constexpr const char* usage =
    "Usage: handloft-modeld COMMAND [OPTIONS]\n"
    "\n"
    "Owns a model: points, surfaces, history.\n"
    "\n"
    "Commands:\n"
    "  run SCRIPT    run a script of operations, queries and expectations\n"
    "  serve         serve a model to viewers and editors, and follow the hand\n"
    "  models        list the models in a folder\n"
    "  history FILE  tell what was done to a model\n"
    "  verify FILE   check a model's file\n"
    "  repair FILE   write what is good of a damaged model to another file\n"
    "  export FILE   write a model, as it is or was, as STEP, IGES, GLB, OBJ or a script\n"
    "\n"
    "Options:\n"
    "  --help        show this text; COMMAND --help shows the command's options\n"
    "  --version     show the version\n"
    "\n"
    "Exit status: 0 done, 1 a script line or the server failed, or a file is damaged, 2 wrong usage.\n";

int run(const std::vector<std::string>& words) {
  const std::string command = words.empty() ? "" : words.front();
  if (command == "--help" || command == "-h") {
    std::fputs(usage, stdout);
    return handloft::model::exit_ok;
  }
  if (command == "--version") {
    std::printf("%s\n", handloft::program_version("handloft-modeld").c_str());
    return handloft::model::exit_ok;
  }
  if (command == "run") return handloft::model::run_command({words.begin() + 1, words.end()});
  if (command == "serve") return handloft::model::serve_command({words.begin() + 1, words.end()});
  if (handloft::model::is_store_command(command))
    return handloft::model::store_command(command, {words.begin() + 1, words.end()});
  if (command == "cad-kernel") return handloft::model::cad_kernel_command({words.begin() + 1, words.end()});
  if (!command.empty())
    std::fprintf(stderr, "handloft-modeld: there is no command \"%s\"\n\n", command.c_str());
  std::fputs(usage, stderr);
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
