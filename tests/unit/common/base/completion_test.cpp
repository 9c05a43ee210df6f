// Completion from the table of options: nothing of it can be forgotten (U7, issue 7 part 6). The shells
// themselves read it in tests/integration/clients/python/test_pages.py.

#include "common/base/completion.h"

#include <gmock/gmock.h>

#include <string>

namespace handloft {
namespace {

using testing::HasSubstr;

struct Fixture {
  std::string listen = "unix:x", level = "info", page, folder, script;
  bool loud = false;
  OptionTable table;
  explicit Fixture(const std::string& name = "handloft-x") : table(name, "Does x.") {
    table.add_positional("SCRIPT", script, "What to do", OptionTable::Presence::optional,
                         {.choices = {"go", "stay"}});
    table.add("listen", listen, "Where it's [at]", {.value_name = "ENDPOINT"});
    table.add("page", page, "What is read", {.value_name = "FILE.toml"});
    table.add("folder", folder, "Where (as a; b); more of it", {.value_name = "DIR"});
    table.add("loud", loud, "Whether: loud");
    table.add("log_level", level, "What is logged", {.choices = {"info", "error"}});
  }
  std::string asked(std::vector<std::string> words) {
    const auto outcome = table.parse(words);
    EXPECT_TRUE(outcome.ok()) << (outcome ? "" : outcome.error().describe());
    if (!outcome) return "";
    EXPECT_EQ(outcome->action, ParseOutcome::Action::show_text);
    return outcome->text;
  }
};

TEST(Completion, BashKnowsEveryFlagAndChoice) {
  for (const auto& words : {std::vector<std::string>{"--completion=bash"}, {"--completion", "bash"}}) {
    const std::string text = Fixture().asked(words);
    EXPECT_THAT(text, HasSubstr("words='go stay --listen --page --folder --loud --no-loud --log-level --help "
                                "--version --config --man --completion'"));
    EXPECT_THAT(text, HasSubstr(" --log-level) value='info error' ;;"));
    EXPECT_THAT(text, HasSubstr("complete -o filenames -F _handloft_x handloft-x\n"));
  }
}

TEST(Completion, ZshKnowsThemWithTheirHelpAndWhatTheirValuesAre) {
  const std::string text = Fixture().asked({"--completion=zsh"});
  EXPECT_TRUE(text.starts_with("#compdef handloft-x\n")) << text;
  for (const char* specification :
       {"'1::SCRIPT:(go stay)'", "'*--listen=[Where it'\\''s [at\\]]:ENDPOINT: '",
        "'*--page=[What is read]:FILE.toml:_files'", "'*--folder=[Where (as a; b)]:DIR:_files -/'",
        "'--loud[Whether: loud]'", "'--no-loud[Whether: loud]'",
        "'*--log-level=[What is logged]:{info,error}:(info error)'", "'--help["})
    EXPECT_THAT(text, HasSubstr(specification));
}

TEST(Completion, FishKnowsThemWithTheirHelpAndWhatTheirValuesAre) {
  const std::string text = Fixture().asked({"--completion=fish"});
  for (const char* line :
       {"complete -c handloft-x -a 'go stay' -d 'SCRIPT'\n", "complete -c handloft-x -f\n",
        "complete -c handloft-x -l listen -x -d 'Where it\\'s [at]'\n",
        "complete -c handloft-x -l page -r -F -d 'What is read'\n",
        "complete -c handloft-x -l folder -x -a '(__fish_complete_directories)' -d 'Where (as a; b)'\n",
        "complete -c handloft-x -l loud -d 'Whether: loud'\n", "complete -c handloft-x -l no-loud -d",
        "complete -c handloft-x -l log-level -x -a 'info error' -d 'What is logged'\n"})
    EXPECT_THAT(text, HasSubstr(line));
}

TEST(Completion, APieceIsOfItsCommand) {
  Fixture fixture("handloft-y serve");
  EXPECT_THAT(fixture.asked({"--completion-section=bash"}), HasSubstr("    serve) words='go stay --listen"));
  EXPECT_THAT(fixture.asked({"--completion-section=zsh"}), HasSubstr("    serve)\n      _arguments \\\n"));
  EXPECT_THAT(fixture.asked({"--completion-section=fish"}),
              HasSubstr("complete -c handloft-y -n '__fish_seen_subcommand_from serve' -l listen "));
  const std::vector<std::pair<std::string, std::string>> commands{{"serve", "serve: it"}};
  EXPECT_THAT(program_completion_begin(Shell::bash, "handloft-y", commands),
              HasSubstr("words='serve --help"));
  EXPECT_THAT(program_completion_begin(Shell::zsh, "handloft-y", commands),
              HasSubstr("'serve:serve\\: it')"));
  EXPECT_THAT(program_completion_begin(Shell::fish, "handloft-y", commands),
              HasSubstr("-n __fish_use_subcommand -f -a serve -d 'serve: it'\n"));
}

TEST(Completion, AnotherShellIsAnErrorThatNamesOurs) {
  for (const auto& words : {std::vector<std::string>{"--completion=tcsh"}, {"--completion", "tcsh"}}) {
    const auto outcome = Fixture().table.parse(words);
    ASSERT_FALSE(outcome.ok());
    EXPECT_EQ(outcome.error().field, "completion");
    EXPECT_EQ(outcome.error().message, "found \"tcsh\", expected bash, zsh or fish");
  }
  EXPECT_FALSE(Fixture().table.parse({"--completion"}).ok());
  const auto of_a_command = Fixture("handloft-y serve").table.parse({"--completion=zsh"});
  ASSERT_FALSE(of_a_command.ok());
  EXPECT_EQ(of_a_command.error().message, "expected before the command: handloft-y --completion=zsh");
  // Only as the first word: elsewhere it is an option that there is not.
  EXPECT_FALSE(Fixture().table.parse({"--listen", "unix:y", "--completion-section=bash"}).ok());
}

}  // namespace
}  // namespace handloft
