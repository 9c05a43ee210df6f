// The limits of a server in its configuration: the example file holds every key, documented, with its
// default.

#include "server-model/session/service_limits.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <set>
#include <sstream>

namespace handloft::session {
namespace {

using ::testing::HasSubstr;

constexpr const char* example = "deploy/config/modeld.toml";

std::string text_of(const char* path) {
  std::ifstream file(path);
  EXPECT_TRUE(file) << "run from the repository's root";
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

/// Every field another than its default.
constexpr const char* others = R"(
[limits]
max_connections = 7
max_half_open = 6
max_half_open_per_address = 5
hello_timeout_s = 1.5
max_handshakes_per_s = 21
max_handshakes_per_s_per_address = 13
max_message_kib = 100
max_messages_per_s = 9
max_pending_requests = 8
max_pending_kib = 101
max_hand_frames_per_s = 99.0
answers_kib = 102
presence_kib = 103
notices_kib = 104
scene_kib = 105
send_buffer_kib = 106
[people]
local_users = "any"
tcp_role = "none"
certificate_days = 3
wrong_codes_per_minute = 4
wrong_codes_per_minute_in_all = 14
audit_entries = 1000
audit_per_minute = 11
audit_strangers_per_minute = 12
)";

TEST(ServiceLimits, TheExampleHoldsEveryKeyWithItsDefault) {
  ServiceLimits limits;
  OptionTable table("test", "");
  limits.add_to(table);
  ASSERT_TRUE(table.parse_toml(others, "others").ok());
  ASSERT_FALSE(limits == ServiceLimits{});
  const Status read = table.parse_toml(text_of(example), example);
  ASSERT_TRUE(read.ok()) << read.error().describe();
  EXPECT_TRUE(limits == ServiceLimits{})
      << "a key is missing there or has another value than without the file";
}

// Each line "key = value" of the example stands below a comment, and there are as many as options.
TEST(ServiceLimits, TheExampleDocumentsEveryKey) {
  std::istringstream lines(text_of(example));
  std::set<std::string> documented;
  std::string section, before;
  for (std::string line; std::getline(lines, line); before = line) {
    if (line.starts_with('[')) section = line.substr(1, line.size() - 2);
    const std::size_t end = line.find(" = ");
    if (line.starts_with('#') || end == std::string::npos) continue;
    EXPECT_TRUE(before.starts_with("# ")) << line;
    std::string flag = "--" + section + "-" + line.substr(0, end);
    std::replace(flag.begin(), flag.end(), '_', '-');
    documented.insert(flag);
  }
  ServiceLimits limits;
  OptionTable table("test", "");
  limits.add_to(table);
  std::set<std::string> flags;
  for (const OptionFacts& option : table.facts().options) {
    if (option.flag.starts_with("--limits-") || option.flag.starts_with("--people-"))
      flags.insert(option.flag);
  }
  EXPECT_EQ(flags, documented);
  EXPECT_EQ(flags.size(), 24U);
}

TEST(ServiceLimits, AnUnknownKeyIsRefusedByName) {
  ServiceLimits limits;
  OptionTable table("test", "");
  limits.add_to(table);
  const Status read = table.parse_toml("[limits]\nmax_conections = 3\n", "modeld.toml");
  ASSERT_FALSE(read.ok());
  EXPECT_THAT(read.error().describe(), HasSubstr("max_conections"));
  EXPECT_FALSE(table.parse_toml("[limits]\nmax_connections = 0\n", "modeld.toml").ok());
  EXPECT_FALSE(table.parse_toml("[people]\ntcp_role = \"god\"\n", "modeld.toml").ok());
}

TEST(ServiceLimits, AreAppliedEachToItsOwn) {
  ServiceLimits limits;
  OptionTable table("test", "");
  limits.add_to(table);
  ASSERT_TRUE(table.parse_toml(others, "others").ok());
  ServerOptions options;
  limits.apply_to(options);
  EXPECT_EQ(options.net.max_connections, 7U);
  EXPECT_EQ(options.net.max_half_open, 6U);
  EXPECT_EQ(options.net.max_half_open_per_address, 5U);
  EXPECT_EQ(options.net.hello_timeout, std::chrono::milliseconds(1500));
  EXPECT_EQ(options.net.handshakes.per_s, 21U);
  EXPECT_EQ(options.net.handshakes.per_s_per_address, 13U);
  EXPECT_EQ(options.net.max_frame_bytes, 100U << 10U);
  EXPECT_EQ(options.net.max_messages_per_s, 9U);
  EXPECT_EQ(options.max_pending_requests, 8U);
  EXPECT_EQ(options.max_pending_bytes, 101U << 10U);
  EXPECT_EQ(options.actor.client_frames.max_frames_per_s, 99.0);
  EXPECT_EQ(options.client_memory.answers_bytes, 102U << 10U);
  EXPECT_EQ(options.client_memory.presence_bytes, 103U << 10U);
  EXPECT_EQ(options.client_memory.notices_bytes, 104U << 10U);
  EXPECT_EQ(options.client_memory.scene_bytes, 105U << 10U);
  EXPECT_EQ(options.net.send_buffer_bytes, 106 << 10);
  EXPECT_EQ(options.net.local_users, net::LocalUsers::any);
  const auto gate = limits.gate_options();
  ASSERT_TRUE(gate.ok());
  EXPECT_EQ(gate->tcp_role, v1::ROLE_UNSPECIFIED);
  EXPECT_EQ(gate->certificate_days, 3);
  EXPECT_EQ(gate->wrong_codes_per_minute, 4U);
  EXPECT_EQ(gate->wrong_codes_per_minute_in_all, 14U);
  EXPECT_EQ(gate->audit.entries, 1000U);
  EXPECT_EQ(gate->audit.per_peer_per_minute, 11U);
  EXPECT_EQ(gate->audit.strangers_per_minute, 12U);
}

}  // namespace
}  // namespace handloft::session
