#include "server-model/session/service_limits.h"

#include <algorithm>
#include <array>
#include <chrono>

namespace handloft::session {

namespace {

constexpr std::uint64_t kib = 1024;

NumberRange whole(double min, double max, const char* unit = "N") {
  return NumberRange{.min = min, .max = max, .value_name = unit};
}

}  // namespace

void ServiceLimits::add_to(OptionTable& table) {
  table.add("limits.max_connections", max_connections, "Clients at a time; more are refused with a reason",
            whole(1, 100'000));
  table.add("limits.max_half_open", max_half_open, "Of those, how many may not have said hello yet",
            whole(1, 10'000));
  table.add("limits.max_half_open_per_address", max_half_open_per_address,
            "The same of one address, by tcp: and tls:", whole(1, 10'000));
  table.add("limits.hello_timeout_s", hello_timeout_s, "Within which a client must have said hello",
            NumberRange{.min = 0.1, .max = 60, .value_name = "S"});
  table.add("limits.max_handshakes_per_s", max_handshakes_per_s,
            "TLS handshakes that are begun, each of which costs a signature; more are let go; 0: any number",
            whole(0, 100'000));
  table.add("limits.max_handshakes_per_s_per_address", max_handshakes_per_s_per_address,
            "The same of one address", whole(0, 100'000));
  table.add("limits.max_message_kib", max_message_kib,
            "Of one message; before the hello 4 KiB whatever this says", whole(64, 256 * 1024, "KIB"));
  table.add("limits.max_messages_per_s", max_messages_per_s,
            "Of one client; one that sends more is read more slowly; 0: any number", whole(0, 1'000'000));
  table.add("limits.max_pending_requests", max_pending_requests,
            "Of one client, not yet answered; with so many it is not read on", whole(1, 100'000));
  table.add("limits.max_pending_kib", max_pending_kib, "The same by their size",
            whole(64, 1024 * 1024, "KIB"));
  table.add("limits.max_hand_frames_per_s", max_hand_frames_per_s, "Of one client's hands; more are left out",
            NumberRange{.min = 1, .max = 10'000, .value_name = "N"});
  table.add("limits.answers_kib", answers_kib,
            "Answers that wait for one client; more that it does not read: it is closed",
            whole(64, 1024 * 1024, "KIB"));
  table.add("limits.presence_kib", presence_kib,
            "Others' presence that waits for one client; more is dropped", whole(16, 1024 * 1024, "KIB"));
  table.add("limits.notices_kib", notices_kib,
            "Notices of who is there that wait for one client; more are dropped",
            whole(16, 1024 * 1024, "KIB"));
  table.add("limits.scene_kib", scene_kib,
            "Former scenes that are kept for what one client holds; beyond, it begins anew with a snapshot",
            whole(64, 1024 * 1024, "KIB"));
  table.add("limits.send_buffer_kib", send_buffer_kib, "The kernel's buffer for each client; 0: the system's",
            whole(0, 1024 * 1024, "KIB"));

  table.add(
      "people.local_users", local_users,
      "Who of this host may connect by unix: sockets: only you and root, or any user who was given a role",
      TextRule{.choices = {"own", "any"}, .value_name = ""});
  table.add("people.tcp_role", tcp_role, "What anybody on this host may do by tcp:, which knows no users",
            TextRule{.choices = {"none", "viewer", "commenter", "editor", "owner"}, .value_name = ""});
  table.add("people.certificate_days", certificate_days,
            "For which a paired device is; then it is paired again", whole(1, 3650, "DAYS"));
  table.add("people.wrong_codes_per_minute", wrong_codes_per_minute,
            "Of one address; more codes of it are not looked at", whole(1, 10'000));
  table.add("people.wrong_codes_per_minute_in_all", wrong_codes_per_minute_in_all, "Of all addresses",
            whole(1, 100'000));
  table.add("people.audit_entries", audit_entries, "In the audit log; the oldest make room",
            whole(100, 10'000'000));
  table.add("people.audit_per_minute", audit_per_minute, "Entries about one user; more are only counted",
            whole(1, 100'000));
  table.add("people.audit_strangers_per_minute", audit_strangers_per_minute,
            "Entries about all strangers together; more are only counted", whole(1, 100'000));
}

void ServiceLimits::apply_to(ServerOptions& options) const {
  options.net.max_connections = max_connections;
  options.net.max_half_open = max_half_open;
  options.net.max_half_open_per_address = max_half_open_per_address;
  options.net.hello_timeout = std::chrono::milliseconds(static_cast<std::int64_t>(hello_timeout_s * 1000));
  options.net.handshakes = {static_cast<std::uint32_t>(max_handshakes_per_s),
                            static_cast<std::uint32_t>(max_handshakes_per_s_per_address)};
  options.net.max_frame_bytes = static_cast<std::uint32_t>(max_message_kib * kib);
  options.net.max_messages_per_s = static_cast<std::uint32_t>(max_messages_per_s);
  options.net.send_buffer_bytes = static_cast<int>(send_buffer_kib * kib);
  options.net.local_users = local_users == "any" ? net::LocalUsers::any : net::LocalUsers::own;
  options.max_pending_requests = max_pending_requests;
  options.max_pending_bytes = max_pending_kib * kib;
  options.actor.client_frames.max_frames_per_s = max_hand_frames_per_s;
  options.client_memory.answers_bytes = answers_kib * kib;
  options.client_memory.presence_bytes = presence_kib * kib;
  options.client_memory.notices_bytes = notices_kib * kib;
  options.client_memory.scene_bytes = scene_kib * kib;
}

bool ServiceLimits::holds_at_once(std::string_view flag) {
  // Each viewer's messages are cut by the first, each hand's inbox is made with the second, and the third is
  // the mode of a socket's file.
  constexpr std::array<std::string_view, 3> with_the_next_start{
      "--limits-max-message-kib", "--limits-max-hand-frames-per-s", "--people-local-users"};
  return (flag.starts_with("--limits-") || flag.starts_with("--people-")) &&
         std::find(with_the_next_start.begin(), with_the_next_start.end(), flag) == with_the_next_start.end();
}

Result<access::GateOptions> ServiceLimits::gate_options() const {
  access::GateOptions options;
  options.tcp_role = v1::ROLE_UNSPECIFIED;
  if (tcp_role != "none") {
    const auto role = access::parse_role(tcp_role);
    if (!role) return make_error(role.error().code, role.error().message, "people.tcp_role");
    options.tcp_role = *role;
  }
  options.certificate_days = certificate_days;
  options.wrong_codes_per_minute = static_cast<std::uint32_t>(wrong_codes_per_minute);
  options.wrong_codes_per_minute_in_all = static_cast<std::uint32_t>(wrong_codes_per_minute_in_all);
  options.audit.entries = static_cast<std::uint32_t>(audit_entries);
  options.audit.per_peer_per_minute = static_cast<std::uint32_t>(audit_per_minute);
  options.audit.strangers_per_minute = static_cast<std::uint32_t>(audit_strangers_per_minute);
  return options;
}

}  // namespace handloft::session
