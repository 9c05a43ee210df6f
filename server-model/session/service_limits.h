#pragma once
// What a server takes of its clients at most, and what it keeps of its people, as its configuration says it
// (deploy/config/modeld.toml): one table of options for `serve --config` and the command line.

#include <cstdint>
#include <string>
#include <string_view>

#include "common/base/config.h"
#include "common/base/result.h"
#include "server-model/access/gate.h"
#include "server-model/session/server_options.h"

namespace handloft::session {

struct ServiceLimits {
  // [limits]
  std::uint64_t max_connections = 256;
  std::uint64_t max_half_open = 64;
  std::uint64_t max_half_open_per_address = 32;
  double hello_timeout_s = 5;
  std::uint64_t max_handshakes_per_s = 200;  ///< By TLS: 0.2 ms each, so 4 % of a core.
  std::uint64_t max_handshakes_per_s_per_address = 30;
  std::uint64_t max_message_kib = 16'384;
  std::uint64_t max_messages_per_s = 5000;  ///< A client's hands and head at 250 Hz are 750.
  std::uint64_t max_pending_requests = 64;
  std::uint64_t max_pending_kib = 32'768;
  double max_hand_frames_per_s = 240;
  std::uint64_t answers_kib = 8'192;
  std::uint64_t presence_kib = 1024;
  std::uint64_t notices_kib = 1024;
  std::uint64_t scene_kib = 2048;
  std::uint64_t send_buffer_kib = 256;

  // [people]
  std::string local_users = "own";
  std::string tcp_role = "editor";
  int certificate_days = 730;
  std::uint64_t wrong_codes_per_minute = 5;
  std::uint64_t wrong_codes_per_minute_in_all = 300;
  std::uint64_t audit_entries = 100'000;
  std::uint64_t audit_per_minute = 60;
  std::uint64_t audit_strangers_per_minute = 300;

  bool operator==(const ServiceLimits&) const = default;

  /// "limits.max_connections", ... This must outlive the table.
  void add_to(OptionTable& table);
  void apply_to(ServerOptions& options) const;
  /// Whether the option with that flag, "--limits-max-connections", holds in a running server when its
  /// configuration is read again; if not, with the next start.
  static bool holds_at_once(std::string_view flag);
  /// Errors: invalid_argument for the TCP role.
  Result<access::GateOptions> gate_options() const;
};

}  // namespace handloft::session
