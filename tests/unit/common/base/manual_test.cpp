// Manual pages from the table of options: nothing of it can be forgotten (U7, issue 7 part 6).

#include "common/base/manual.h"

#include <gmock/gmock.h>

#include <string>

namespace handloft {
namespace {

using testing::HasSubstr;
using testing::Not;

struct Fixture {
  std::string listen = "unix:x";
  double rate = 60;
  bool loud = false;
  std::string level = "info";
  std::string script;
  OptionTable table{"handloft-x", "Does x. And more.\n.not a command"};
  Fixture() {
    table.add_positional("SCRIPT", script, "What to do", OptionTable::Presence::optional,
                         {.choices = {"go", "stay"}});
    table.add("listen", listen, "Where to listen", {.value_name = "ENDPOINT"});
    table.add("video.rate_hz", rate, "Frames a second \\ not more", {.min = 1, .max = 240});
    table.add("loud", loud, "'Tis loud");
    table.add("log_level", level, "What is logged", {.choices = {"info", "error"}});
  }
  std::string asked(std::vector<std::string> words) {
    const auto outcome = table.parse(words);
    EXPECT_TRUE(outcome.ok()) << (outcome ? "" : outcome.error().describe());
    EXPECT_EQ(outcome->action, ParseOutcome::Action::show_text);
    return outcome->text;
  }
};

TEST(Manual, APageHasEveryOptionWithItsValueDefaultAndHelp) {
  Fixture fixture;
  const std::string page = fixture.asked({"--man"});
  EXPECT_TRUE(page.starts_with(".TH HANDLOFT\\-X 1 ")) << page;
  EXPECT_THAT(page, HasSubstr("handloft\\-x \\- does x\n"));
  EXPECT_THAT(page, HasSubstr("\\fB\\-\\-listen\\fR \\fIENDPOINT\\fR\nWhere to listen (default: unix:x)"));
  EXPECT_THAT(page, HasSubstr("\\fB\\-\\-video\\-rate\\-hz\\fR \\fINUMBER\\fR"));
  EXPECT_THAT(page, HasSubstr("\\fB\\-\\-loud\\fR, \\fB\\-\\-no\\-loud\\fR\n"));
  EXPECT_THAT(page, HasSubstr("\\fBSCRIPT\\fR\nWhat to do"));
  EXPECT_THAT(page, HasSubstr("{info,error}"));
  for (const char* common : {"help", "version", "config", "man", "completion"})
    EXPECT_THAT(page, HasSubstr(std::string("\\-\\-") + common));
}

TEST(Manual, WhatIsAskedForIsNotShownAsIfItWereOptional) {
  std::string from, to;
  OptionTable table{"handloft-x", "Does x."};
  table.add_positional("FROM", from, "What to read", OptionTable::Presence::required);
  table.add_positional("TO", to, "What to write", OptionTable::Presence::optional);
  const auto outcome = table.parse({"--man"});
  ASSERT_TRUE(outcome.ok());
  EXPECT_THAT(outcome->text, HasSubstr("[\\fIOPTIONS\\fR] \\fIFROM\\fR [\\fITO\\fR]\n"));
}

TEST(Manual, TextOfOursIsNoCommandOfThePage) {
  Fixture fixture;
  const std::string page = fixture.asked({"--man"});
  EXPECT_THAT(page, HasSubstr("\n\\&.not a command"));
  EXPECT_THAT(page, HasSubstr("\n\\&'Tis loud"));
  EXPECT_THAT(page, HasSubstr("second \\e not more"));
  EXPECT_THAT(page, Not(HasSubstr("\n'")));
}

TEST(Manual, APageOfCommandsHasThemAndTheirSections) {
  Fixture fixture;
  const std::string page = program_man_begin("handloft-y", "Does y.", {{"serve", "serve - it"}}) +
                           fixture.asked({"--man-section"}) + program_man_end();
  EXPECT_THAT(page, HasSubstr(".TP\n\\fBserve\\fR\nserve \\- it\n"));
  EXPECT_THAT(page, HasSubstr(".SS handloft\\-x\n"));
  EXPECT_THAT(page, HasSubstr("\\fB\\-\\-listen\\fR"));
}

}  // namespace
}  // namespace handloft
