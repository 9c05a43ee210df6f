#include "common/base/log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>

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
