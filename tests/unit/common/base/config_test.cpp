// One table of options gives flags, TOML keys and --help (issue 2, part 3): flag > file > default, and every
// mistake is named by file, line and key.

#include "common/base/config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/test_data.h"

namespace handloft {
namespace {

using testing::ContainsRegex;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

struct Options {
  std::string listen = "unix:/default";
  std::optional<std::string> record;
  std::vector<std::string> views;
  std::string mode = "live";
  double rate_hz = 30.0;
  int threads = 2;
  std::uint64_t seed = 1;
  bool video = true;
  bool loud = false;
};

OptionTable table_of(Options& options) {
  OptionTable table("handloft-test", "Tests options.");
  table.add("listen", options.listen, "Where to listen", {.value_name = "ENDPOINT"});
  table.add("record", options.record, "Where to record");
  table.add("views", options.views, "Views");
  table.add("mode", options.mode, "How", {.choices = {"live", "replay"}});
  table.add("camera.rate_hz", options.rate_hz, "Frames a second", {.min = 1, .max = 240});
  table.add("camera.threads", options.threads, "Threads", {.min = 1, .max = 64});
  table.add("seed", options.seed, "Seed");
  table.add("video", options.video, "Offer video");
  table.add("loud", options.loud, "Say more");
  return table;
}

Status parse_text(Options& options, std::string_view text) {
  return table_of(options).parse_toml(text, "handloft.toml");
}

TEST(Config, DefaultsStandWithoutArguments) {
  Options options;
  ASSERT_TRUE(table_of(options).parse(std::vector<std::string>{}).ok());
  EXPECT_EQ(options.listen, "unix:/default");
  EXPECT_FALSE(options.record.has_value());
  EXPECT_TRUE(options.video);
}

TEST(Config, EveryTypeAsFlag) {
  Options options;
  const auto outcome =
      table_of(options).parse({"--listen", "tcp:localhost:1", "--record=x.rec", "--views", "a", "--views",
                               "b", "--mode", "replay", "--camera-rate-hz", "59.94", "--camera-threads", "7",
                               "--seed", "18446744073709551615", "--no-video", "--loud"});
  ASSERT_TRUE(outcome.ok()) << outcome.error().describe();
  EXPECT_EQ(options.listen, "tcp:localhost:1");
  EXPECT_EQ(options.record, "x.rec");
  EXPECT_THAT(options.views, ElementsAre("a", "b"));
  EXPECT_EQ(options.mode, "replay");
  EXPECT_EQ(options.rate_hz, 59.94);
  EXPECT_EQ(options.threads, 7);
  EXPECT_EQ(options.seed, 18446744073709551615u);
  EXPECT_FALSE(options.video);
  EXPECT_TRUE(options.loud);
}

TEST(Config, EveryTypeInTheFile) {
  Options options;
  const Status status = parse_text(options, R"(
listen = "tcp:localhost:1"
record = "x.rec"
views = ["a", "b"]
mode = "replay"
seed = 7
video = false
[camera]
rate_hz = 60      # a whole number will do
threads = 3
)");
  ASSERT_TRUE(status.ok()) << status.error().describe();
  EXPECT_EQ(options.listen, "tcp:localhost:1");
  EXPECT_EQ(options.record, "x.rec");
  EXPECT_THAT(options.views, ElementsAre("a", "b"));
  EXPECT_EQ(options.rate_hz, 60.0);
  EXPECT_EQ(options.threads, 3);
  EXPECT_EQ(options.seed, 7u);
  EXPECT_FALSE(options.video);
}

TEST(Config, AFlagBeatsTheFileAndTheFileTheDefault) {
  const test::TemporaryDirectory folder;
  const std::string file = (folder.path() / "handloft.toml").string();
  std::ofstream(file) << "seed = 5\nlisten = \"unix:/file\"\n";
  Options options;
  const auto outcome = table_of(options).parse({"--config", file, "--listen", "unix:/flag"});
  ASSERT_TRUE(outcome.ok()) << outcome.error().describe();
  EXPECT_EQ(outcome->config_file, file);
  EXPECT_EQ(options.seed, 5u);
  EXPECT_EQ(options.listen, "unix:/flag");
}

TEST(Config, WhatWasGivenIsToldFromADefaultThatIsTheSame) {
  const test::TemporaryDirectory folder;
  const std::string file = (folder.path() / "given.toml").string();
  std::ofstream(file) << "seed = 1\n[camera]\nthreads = 2\n";
  Options options;
  OptionTable table = table_of(options);
  ASSERT_TRUE(table.parse({"--listen", "unix:/default", "--no-loud", "--config", file}).ok());
  for (const char* key : {"listen", "loud", "seed", "camera.threads"}) EXPECT_TRUE(table.given(key)) << key;
  for (const char* key : {"record", "views", "mode", "camera.rate_hz", "video"})
    EXPECT_FALSE(table.given(key)) << key;
  ASSERT_TRUE(table.parse(std::vector<std::string>{}).ok());
  for (const char* key : {"listen", "loud", "seed"}) EXPECT_FALSE(table.given(key)) << key;
}

TEST(Config, AnUnknownKeyNamesFileLineAndKey) {
  Options options;
  const Status status = parse_text(options, "seed = 1\n\n[camera]\nrate_hs = 3\n");
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error().describe(), HasSubstr("handloft.toml:4: camera.rate_hs"));
  EXPECT_THAT(status.error().message, HasSubstr("did you mean \"camera.rate_hz\""));
}

TEST(Config, WhatAnotherCommandReadsOfTheSameFileIsPassedOver) {
  Options options, others;
  const OptionTable other = table_of(others);
  OptionTable table("handloft-test users", "Reads the same file.");
  table.add("listen", options.listen, "Where");
  table.pass_over(other);
  const std::string_view both =
      "listen = 'unix:/both'\nmode = 'neither'\n[camera]\nrate_hz = 9\nthreads = 'x'\n";
  ASSERT_TRUE(table.parse_toml(both, "f.toml").ok());
  EXPECT_EQ(options.listen, "unix:/both");
  EXPECT_EQ(others.rate_hz, 30.0);
  EXPECT_EQ(table.parse_toml("[camera]\nrate_h = 9\n", "f.toml").error().field, "f.toml:2: camera.rate_h");
  EXPECT_FALSE(table.parse_toml("camera_rate_hz = 9\n", "f.toml").ok());
  EXPECT_FALSE(table.parse({"--mode", "live"}).ok()) << "it is no flag";
}

TEST(Config, AWrongTypeNamesWhatWasFoundAndExpected) {
  Options options;
  const Status status = parse_text(options, "\nseed = \"many\"\n");
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error().describe(), HasSubstr("handloft.toml:2: seed"));
  EXPECT_THAT(status.error().message, HasSubstr("many"));
  EXPECT_THAT(status.error().message, HasSubstr("expected a whole number"));
}

TEST(Config, NumbersOutOfRangeAreRefusedInBothPlaces) {
  for (const char* text :
       {"[camera]\nrate_hz = 0.5", "[camera]\nrate_hz = 1e9", "[camera]\nrate_hz = nan",
        "[camera]\nrate_hz = inf", "[camera]\nthreads = 65", "[camera]\nthreads = 1.5", "seed = -1"}) {
    Options options;
    EXPECT_FALSE(parse_text(options, text).ok()) << text;
  }
  using Words = std::vector<std::string>;
  for (const Words& words :
       {Words{"--camera-rate-hz", "0.5"}, Words{"--camera-rate-hz", "nan"},
        Words{"--camera-rate-hz", "30 fps"}, Words{"--camera-threads", "99999999999999999999"},
        Words{"--camera-threads", ""}, Words{"--seed", "-1"}, Words{"--mode", "other"}}) {
    Options options;
    EXPECT_FALSE(table_of(options).parse(words).ok()) << words[0] << " " << words[1];
  }
}

TEST(Config, AChoiceNamesTheChoices) {
  Options options;
  const Status status = parse_text(options, "mode = \"tape\"");
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error().message, HasSubstr("live, replay"));
}

TEST(Config, SyntaxErrorsNameTheLine) {
  Options options;
  const Status status = parse_text(options, "seed = 1\nlisten = unix\n");
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error().field, HasSubstr("handloft.toml:2"));
}

TEST(Config, UnknownFlagsAndMissingFilesAreErrors) {
  Options options;
  EXPECT_FALSE(table_of(options).parse({"--lisen", "x"}).ok());
  EXPECT_FALSE(table_of(options).parse(std::vector<std::string>{"word"}).ok());
  const auto missing = table_of(options).parse({"--config", "/does/not/exist.toml"});
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().code, ErrorCode::not_found);
  EXPECT_THAT(missing.error().describe(), HasSubstr("/does/not/exist.toml"));
}

TEST(Config, PositionalsComeInOrderAndMayBeRequired) {
  std::string command, script, output;
  OptionTable table("handloft-modeld", "Test.");
  table.add_positional("COMMAND", command, "serve or run", OptionTable::Presence::required,
                       {.choices = {"serve", "run"}});
  table.add_positional("SCRIPT", script, "What to run", OptionTable::Presence::optional);
  table.add("output", output, "Where to");
  ASSERT_TRUE(table.parse({"run", "--output", "out", "a.jsonl"}).ok());
  EXPECT_EQ(command, "run");
  EXPECT_EQ(script, "a.jsonl");
  EXPECT_EQ(output, "out");
  EXPECT_FALSE(table.parse(std::vector<std::string>{}).ok());
  EXPECT_FALSE(table.parse(std::vector<std::string>{"walk"}).ok());
}

TEST(Config, HelpNamesEveryOptionWithItsDefault) {
  Options options;
  OptionTable table = table_of(options);
  const auto outcome = table.parse(std::vector<std::string>{"--help"});
  ASSERT_TRUE(outcome.ok());
  EXPECT_EQ(outcome->action, ParseOutcome::Action::show_text);
  for (const char* text : {"--listen ENDPOINT", "unix:/default", "--camera-rate-hz", "Frames a second",
                           "--no-video", "--config FILE", "{live,replay}"}) {
    EXPECT_THAT(outcome->text, HasSubstr(text));
  }
  EXPECT_EQ(outcome->text, table.help());
  EXPECT_THAT(outcome->text, ContainsRegex("--video, --no-video +Offer video \\(default: on\\)"));
  EXPECT_THAT(outcome->text, ContainsRegex("--loud, --no-loud +Say more \\(default: off\\)"));
  EXPECT_THAT(outcome->text, Not(HasSubstr("{false}")));
}

TEST(Config, VersionIsShownEvenWhenAPositionalIsMissing) {
  std::string command;
  OptionTable table("handloft-modeld", "Test.");
  table.add_positional("COMMAND", command, "serve or run", OptionTable::Presence::required);
  const auto outcome = table.parse(std::vector<std::string>{"--version"});
  ASSERT_TRUE(outcome.ok());
  EXPECT_THAT(outcome->text, testing::StartsWith("handloft-modeld "));
}

}  // namespace
}  // namespace handloft
