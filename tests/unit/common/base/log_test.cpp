#include "common/base/log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

namespace handloft {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(Log, ALineCarriesLevelAndComponent) {
  std::ostringstream out;
  const Logger log("net", LogLevel::info, std::make_shared<spdlog::sinks::ostream_sink_mt>(out));
  log.debug("unheard");
  log.component("server").warning("{} readers", 3);
  EXPECT_THAT(out.str(), HasSubstr("warning [server] 3 readers"));
  EXPECT_THAT(out.str(), Not(HasSubstr("unheard")));
}

TEST(Log, AFieldOfALoggerIsInEveryLineOfItAndItsComponents) {
  std::ostringstream out;
  const Logger log("modeld", LogLevel::info, std::make_shared<spdlog::sinks::ostream_sink_mt>(out));
  const Logger seat = log.with("model", "seat");
  seat.component("net").with("client", "7").info("came");
  EXPECT_THAT(out.str(), HasSubstr("[net model=seat client=7] came"));
  out.str("");
  log.info("nobody's");
  EXPECT_THAT(out.str(), HasSubstr("[modeld] nobody's"));
}

TEST(Log, JsonLinesAreOneObjectEachWhateverTheTexts) {
  std::ostringstream out;
  const Logger log("net", LogLevel::info, std::make_shared<spdlog::sinks::ostream_sink_mt>(out),
                   LogFormat::json);
  log.with("model", "a\"b")
      .with("client", std::string("7\x1fx=y"))
      .warning("two\nlines \xff \"quoted\" {}", 3);
  const std::string text = out.str();
  ASSERT_EQ(std::count(text.begin(), text.end(), '\n'), 1);
  const auto line = nlohmann::json::parse(text);
  EXPECT_EQ(line.at("level"), "warning");
  EXPECT_EQ(line.at("component"), "net");
  EXPECT_EQ(line.at("model"), "a\"b");
  EXPECT_EQ(line.at("client"), "7x=y");
  EXPECT_EQ(line.at("message"), "two\nlines \xef\xbf\xbd \"quoted\" 3");
  EXPECT_TRUE(line.at("time").get<std::string>().ends_with("Z"));
  EXPECT_EQ(line.size(), 6U);
  EXPECT_EQ(*parse_log_format("json"), LogFormat::json);
  EXPECT_FALSE(parse_log_format("xml").ok());
}

// SIGHUP changes the level of a running program, all of whose components were made before.
TEST(Log, AnotherLevelHoldsForAllComponentsThatThereAre) {
  std::ostringstream out;
  Logger log("modeld", LogLevel::warning, std::make_shared<spdlog::sinks::ostream_sink_mt>(out));
  const Logger client = log.component("net").with("client", "7");
  client.info("unheard");
  log.set_level(LogLevel::debug);
  client.debug("heard");
  log.set_level(LogLevel::off);
  client.error("unheard");
  EXPECT_THAT(out.str(), HasSubstr("debug   [net client=7] heard"));
  EXPECT_THAT(out.str(), Not(HasSubstr("unheard")));
}

TEST(Log, LevelsHaveNamesAndOthersAreRefused) {
  for (const LogLevel level : {LogLevel::trace, LogLevel::debug, LogLevel::info, LogLevel::warning,
                               LogLevel::error, LogLevel::off}) {
    const auto parsed = parse_log_level(to_string(level));
    ASSERT_TRUE(parsed.ok());
    EXPECT_EQ(*parsed, level);
  }
  EXPECT_FALSE(parse_log_level("loud").ok());
}

TEST(Log, RateLimitSpeaksOnceInItsIntervalAndCountsWhatItKeptBack) {
  RateLimit limit(std::chrono::seconds(1));
  EXPECT_EQ(limit.allow(from_ns(0)), 0u);
  EXPECT_EQ(limit.allow(from_ns(10)), std::nullopt);
  EXPECT_EQ(limit.allow(from_ns(999'999'999)), std::nullopt);
  EXPECT_EQ(limit.allow(from_ns(1'000'000'000)), 2u);
  EXPECT_EQ(limit.allow(from_ns(2'000'000'000)), 0u);
}

}  // namespace
}  // namespace handloft
