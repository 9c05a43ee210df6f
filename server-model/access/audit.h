#pragma once
// The audit log (U2): who came, left, was refused, got another role, was invited, paired or revoked. It lies
// in the access file, bounded: the oldest entries make room, and no peer can fill it by being refused often.

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>

namespace handloft::access {

enum class AuditKind { join, leave, refusal, role, invite, pairing, revocation, suppressed };
/// "join", ...
std::string_view to_string(AuditKind kind);

struct AuditEvent {
  AuditKind kind = AuditKind::refusal;
  std::string user = {};     ///< Whom it is about; empty: unknown.
  std::string device = {};   ///< Fingerprint of a certificate.
  std::string address = {};  ///< Where from; empty: this host.
  std::string model = {};
  std::string detail = {};  ///< In words. Cut to a few hundred bytes; control characters become spaces.
};

/// One that was kept.
struct AuditEntry {
  std::int64_t number = 0;
  std::int64_t time_ns = 0;  ///< Since 1970, UTC.
  AuditEvent event = {};
  std::string kind = {};
};

struct AuditLimits {
  std::uint32_t entries = 100'000;  ///< About 30 MiB; the oldest make room.
  std::uint32_t per_peer_per_minute =
      60;  ///< Of one user or, for strangers, one address; more are only counted.
  std::uint32_t strangers_per_minute = 300;  ///< Of all addresses without a user together.
  std::uint32_t waiting = 1'000;             ///< Not yet written; more are only counted.
};

/// Decides which events are written. What was left out of a peer's is told with the next one that is let
/// through. Not thread-safe; bounded memory whatever peers do.
class AuditThrottle {
 public:
  explicit AuditThrottle(AuditLimits limits) : limits_(limits) {}
  /// Whether an event of `key` is to be written now; `is_stranger`: the key is an address, of which there are
  /// many.
  enum class Who { user, stranger };
  bool admits(const std::string& key, Who who, std::int64_t now_s);
  void set_limits(AuditLimits limits) { limits_ = limits; }
  /// How many have been left out since the last call.
  std::uint64_t take_left_out();

 private:
  AuditLimits limits_;
  std::int64_t minute_ = 0;
  std::map<std::string, std::uint32_t> counts_;  ///< In this minute; at most a few thousand keys.
  std::uint32_t strangers_ = 0;
  std::uint64_t left_out_ = 0;
};

}  // namespace handloft::access
