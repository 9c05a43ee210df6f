// Scripts of camera paths: what they say, and that every mistake is told with file, line and field.

#include "client-hmd/shots/shot_script.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <glm/gtc/constants.hpp>

namespace handloft::client {
namespace {

using testing::HasSubstr;

constexpr const char* good = R"(size = "640x360"
rate = 24
supersampling = 1
loop = true
background = "transparent"
stereo = true
eye_distance = 0.06
[[key]]
time = 0
orbit = { azimuth = -90, elevation = 20, distance = 0.5 }
[[key]]
time = 2.5
target = [0.1, 0, 0.02]
orbit = { azimuth = 270 }
field_of_view = 40
[[change]]
time = 1
show = "surface"
shading = "zebra"
)";

TEST(ShotScript, SaysAllThatThereIs_V8) {
  const Result<ShotPlan> plan = parse_shot_script(good, "good.toml");
  ASSERT_TRUE(plan.ok()) << plan.error().describe();
  EXPECT_EQ(plan->width_px, 640);
  EXPECT_EQ(plan->height_px, 360);
  EXPECT_EQ(plan->supersampling, 1);
  EXPECT_EQ(plan->ends, CameraPath::Ends::loop);
  EXPECT_EQ(plan->background, ShotBackground::transparent);
  EXPECT_EQ(plan->eyes, ShotEyes::side_by_side);
  EXPECT_EQ(plan->eye_distance_m, 0.06);
  EXPECT_EQ(plan->frames(), 60U);
  ASSERT_EQ(plan->keys.size(), 2U);
  EXPECT_TRUE(std::holds_alternative<SceneCentre>(plan->keys[0].target)) << "unless said otherwise";
  const auto& last = std::get<OrbitPlace>(plan->keys[1].place);
  EXPECT_NEAR(last.azimuth_rad, 1.5 * glm::pi<double>(), 1e-12);
  EXPECT_FALSE(last.distance_m);
  EXPECT_NEAR(plan->keys[1].fov_y_rad, 40.0 * glm::pi<double>() / 180.0, 1e-12);
  EXPECT_EQ(std::get<glm::dvec3>(plan->keys[1].target), glm::dvec3(0.1, 0, 0.02));
  ASSERT_EQ(plan->changes.size(), 1U);
  EXPECT_EQ(plan->changes[0].show, Representation::surface);
  EXPECT_EQ(plan->changes[0].shading, Shading::zebra);
}

TEST(ShotScript, OneKeyIsAStill) {
  const Result<ShotPlan> plan = parse_shot_script("[[key]]\ntime = 0\neye = [0, -1, 1]\n", "still.toml");
  ASSERT_TRUE(plan.ok()) << plan.error().describe();
  EXPECT_EQ(plan->frames(), 1U);
}

struct Mistake {
  const char* name;
  std::string (*spoil)(std::string);
  const char* field;
  const char* words;  ///< In the message.
};

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), by);
}

class AMistake : public testing::TestWithParam<Mistake> {};

TEST_P(AMistake, IsToldWithItsPlace_V8) {
  const Result<ShotPlan> plan = parse_shot_script(GetParam().spoil(good), "bad.toml");
  ASSERT_FALSE(plan.ok());
  EXPECT_EQ(plan.error().field, GetParam().field) << plan.error().describe();
  EXPECT_THAT(plan.error().message, HasSubstr(GetParam().words));
}

INSTANTIATE_TEST_SUITE_P(
    Every, AMistake,
    testing::Values(
        Mistake{"Size", [](std::string s) { return replaced(s, "640x360", "640x9"); }, "size",
                "found '640x9', expected \"WIDTHxHEIGHT\" within 16..8192 (bad.toml, line 1)"},
        Mistake{"SizeWithATail", [](std::string s) { return replaced(s, "640x360", "640x360p"); }, "size",
                "640x360p"},
        Mistake{"Rate", [](std::string s) { return replaced(s, "24", "0"); }, "rate",
                "found 0, expected 1..240 (bad.toml, line 2)"},
        Mistake{"RateAsText", [](std::string s) { return replaced(s, "24", "\"24\""); }, "rate",
                "expected 1..240"},
        Mistake{"RateOfNan", [](std::string s) { return replaced(s, "24", "nan"); }, "rate", "nan"},
        Mistake{"Supersampling",
                [](std::string s) { return replaced(s, "supersampling = 1", "supersampling = 9"); },
                "supersampling", "1..4"},
        Mistake{"UnknownField", [](std::string s) { return "speed = 2\n" + s; }, "speed",
                "is no field of a script (bad.toml, line 1)"},
        Mistake{"UnknownFieldOfAKey",
                [](std::string s) { return replaced(s, "time = 2.5", "time = 2.5\nroll = 1"); },
                "key[1].roll", "line 13"},
        Mistake{"UnknownFieldOfAnOrbit",
                [](std::string s) { return replaced(s, "azimuth = 270", "azimut = 270"); },
                "key[1].orbit.azimut", "line 14"},
        Mistake{"Distance", [](std::string s) { return replaced(s, "distance = 0.5", "distance = -3"); },
                "key[0].orbit.distance", "found -3, expected 0.01..100 (bad.toml, line 10)"},
        Mistake{"Elevation", [](std::string s) { return replaced(s, "elevation = 20", "elevation = 90"); },
                "key[0].orbit.elevation", "89.9"},
        Mistake{"FieldOfView",
                [](std::string s) { return replaced(s, "field_of_view = 40", "field_of_view = 400"); },
                "key[1].field_of_view", "1..120"},
        Mistake{"Target", [](std::string s) { return replaced(s, "[0.1, 0, 0.02]", "\"table\""); },
                "key[1].target", "\"scene\" or [x, y, z]"},
        Mistake{"TargetOfTwo", [](std::string s) { return replaced(s, "[0.1, 0, 0.02]", "[0.1, 0]"); },
                "key[1].target", "[x, y, z]"},
        Mistake{"TargetOfInfinity",
                [](std::string s) { return replaced(s, "[0.1, 0, 0.02]", "[inf, 0, 0]"); }, "key[1].target",
                "[x, y, z]"},
        Mistake{"EyeAndOrbit",
                [](std::string s) { return replaced(s, "time = 2.5", "time = 2.5\neye = [0, 0, 1]"); },
                "key[1].eye", "either an eye or an orbit"},
        Mistake{"NeitherEyeNorOrbit",
                [](std::string s) { return replaced(s, "orbit = { azimuth = 270 }", ""); }, "key[1].eye",
                "either an eye or an orbit"},
        Mistake{"TimeBackwards", [](std::string s) { return replaced(s, "time = 2.5", "time = 0"); },
                "key[1].time", "expected more than the 0 s of the one before (bad.toml, line 12)"},
        Mistake{"NoTime", [](std::string s) { return replaced(s, "time = 2.5", ""); }, "key[1].time",
                "seconds"},
        Mistake{"FirstTime", [](std::string s) { return replaced(s, "time = 0", "time = 1"); }, "key[0].time",
                "expected 0 for the first key"},
        Mistake{"Show", [](std::string s) { return replaced(s, "\"surface\"", "\"solid\""); },
                "change[0].show",
                "found 'solid', expected one of \"points\", \"surface\", \"both\" (bad.toml, line 18)"},
        Mistake{"Shading", [](std::string s) { return replaced(s, "\"zebra\"", "\"zebras\""); },
                "change[0].shading", "\"studio\""},
        Mistake{"Easing", [](std::string s) { return "easing = \"bouncy\"\n" + s; }, "easing", "\"linear\""},
        Mistake{"NoKeys", [](std::string) { return std::string("rate = 30\n"); }, "key",
                "one [[key]] at least"},
        Mistake{"KeysThatAreNumbers", [](std::string) { return std::string("key = [1, 2]\n"); }, "key",
                "[[key]] tables"},
        Mistake{"NoToml", [](std::string) { return std::string("rate = \n"); }, "bad.toml:1", ""},
        Mistake{"TooLong", [](std::string s) { return replaced(s, "time = 2.5", "time = 3600.5"); },
                "key[1].time", "3600"}),
    [](const testing::TestParamInfo<Mistake>& item) { return std::string(item.param.name); });

TEST(ShotScript, HasLimits) {
  ShotLimits limits;
  limits.max_frames = 59;
  EXPECT_EQ(parse_shot_script(good, "g.toml", limits).error().code, ErrorCode::resource_exhausted);
  limits.max_frames = 60;
  EXPECT_TRUE(parse_shot_script(good, "g.toml", limits).ok());
  limits.max_keys = 1;
  EXPECT_EQ(parse_shot_script(good, "g.toml", limits).error().code, ErrorCode::resource_exhausted);
  limits.max_file_bytes = 10;
  EXPECT_EQ(parse_shot_script(good, "g.toml", limits).error().field, "g.toml");
}

TEST(ShotScript, AFileThatIsNotThereIsToldSo) {
  EXPECT_EQ(read_shot_script("/nowhere/at/all.toml").error().code, ErrorCode::not_found);
}

TEST(ShotScript, TheExampleOfTheReadmeIsOne) {
  const Result<ShotPlan> plan = read_shot_script("client-hmd/shots/example.toml");
  ASSERT_TRUE(plan.ok()) << plan.error().describe();
  EXPECT_GE(plan->keys.size(), 3U);
  EXPECT_GE(plan->changes.size(), 2U);
}

}  // namespace
}  // namespace handloft::client
