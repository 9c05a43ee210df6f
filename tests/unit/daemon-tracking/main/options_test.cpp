#include "daemon-tracking/main/options.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace handloft::tracking {
namespace {

// The field that is refused; empty: all is well.
std::string refused_field(std::vector<const char*> arguments) {
  DaemonOptions options;
  OptionTable table = make_option_table(options);
  arguments.insert(arguments.begin(), "handloft-trackd");
  const auto parsed = table.parse(static_cast<int>(arguments.size()), const_cast<char**>(arguments.data()));
  if (!parsed) return "parse: " + parsed.error().describe();
  if (const Status resolved = resolve_command(options); !resolved) return resolved.error().field;
  const Status status = check(options);
  return status ? "" : status.error().field;
}

TEST(DaemonOptions, NotTwoSources) {
  EXPECT_EQ(refused_field({}), "") << "the devices of this computer";
  EXPECT_EQ(refused_field({"--simulate", "mouse"}), "");
  EXPECT_EQ(refused_field({"--replay", "a.rec"}), "");
  EXPECT_EQ(refused_field({"--simulate", "mouse", "--replay", "a.rec"}), "replay");
}

TEST(DaemonOptions, StrokesGoWithTheirSimulation) {
  EXPECT_EQ(refused_field({"--simulate", "strokes"}), "strokes");
  EXPECT_EQ(refused_field({"--simulate", "strokes", "--strokes", "a.tilt"}), "");
  EXPECT_EQ(refused_field({"--simulate", "mouse", "--strokes", "a.tilt"}), "strokes");
}

TEST(DaemonOptions, ARecordingIsNotWrittenOverItself) {
  EXPECT_EQ(refused_field({"--replay", "a.rec", "--record", "a.rec"}), "record");
  EXPECT_EQ(refused_field({"--replay", "a.rec", "--record", "b.rec"}), "");
}

TEST(DaemonOptions, CommandsStandForFlags) {
  EXPECT_EQ(refused_field({"run"}), "");
  EXPECT_EQ(refused_field({"record"}), "FILE");
  EXPECT_EQ(refused_field({"record", "a.rec"}), "");
  EXPECT_EQ(refused_field({"record", "a.rec", "--record", "b.rec"}), "record");
  EXPECT_EQ(refused_field({"replay", "a.rec"}), "");
  EXPECT_EQ(refused_field({"replay", "a.rec", "--simulate", "mouse"}), "replay");
  EXPECT_EQ(refused_field({"doctor", "a.rec"}), "FILE");
  EXPECT_NE(refused_field({"recrod", "a.rec"}), "");
  DaemonOptions options;
  options.command = "replay";
  options.file = "a.rec";
  ASSERT_TRUE(resolve_command(options).ok());
  EXPECT_EQ(options.replay, "a.rec");
  EXPECT_FALSE(uses_devices(options));
}

TEST(DaemonOptions, OnlyReplaysHaveASpeedT13) {
  EXPECT_EQ(refused_field({"replay", "a.rec", "--speed", "2"}), "");
  EXPECT_EQ(refused_field({"replay", "a.rec", "--speed", "0.05"}), "speed");
  EXPECT_NE(refused_field({"replay", "a.rec", "--speed", "101"}), "");
  EXPECT_NE(refused_field({"replay", "a.rec", "--speed", "nan"}), "");
  EXPECT_EQ(refused_field({"--simulate", "mouse", "--speed", "2"}), "speed");
  EXPECT_EQ(refused_field({"--simulate", "mouse", "--repeat", "2"}), "repeat");
  EXPECT_EQ(refused_field({"replay", "a.rec", "--speed", "2", "--pace", "fast"}), "pace");
  EXPECT_EQ(refused_field({"--pace", "fast"}), "pace") << "devices come in real time";
}

TEST(DaemonOptions, ASimulatedRigTakesNoCalibration) {
  EXPECT_EQ(refused_field({"--simulate", "mouse", "--calibration", "a.toml"}), "calibration");
  EXPECT_EQ(refused_field({"--calibration", "a.toml"}), "");
}

TEST(DaemonOptions, HelpTellsTheExitStatus) {
  DaemonOptions options;
  OptionTable table = make_option_table(options);
  const char* help[] = {"handloft-trackd", "--help"};
  const auto parsed = table.parse(2, const_cast<char**>(help));
  ASSERT_TRUE(parsed.ok());
  for (const char* word : {"Exit status: 0", "; 1 ", "damaged", "; 2 wrong usage"}) {
    EXPECT_NE(parsed->text.find(word), std::string::npos) << word << " in " << parsed->text;
  }
}

TEST(DaemonOptions, TheTableParsesFlagsAndRefusesNonsense) {
  DaemonOptions options;
  OptionTable table = make_option_table(options);
  const char* good[] = {"handloft-trackd", "--simulate", "mouse", "--seed", "7", "--exit-at-end"};
  ASSERT_TRUE(table.parse(6, const_cast<char**>(good)).ok());
  EXPECT_EQ(options.simulate, "mouse");
  EXPECT_EQ(options.seed, 7u);
  EXPECT_TRUE(options.exit_at_end);
  for (const char* value : {"0", "1e9", "nan", "fast"}) {
    DaemonOptions other;
    OptionTable other_table = make_option_table(other);
    const char* bad[] = {"handloft-trackd", "--camera-rate-hz", value};
    EXPECT_FALSE(other_table.parse(3, const_cast<char**>(bad)).ok()) << value;
  }
}

}  // namespace
}  // namespace handloft::tracking
