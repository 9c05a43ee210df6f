#pragma once
// Who may come in and what they may do there (U2): the one door between connections and models. All that it
// answers comes from memory; the file behind it (access_file.h) is read anew when somebody has changed it,
// and written by a thread of its own, so that nobody who shapes waits for a disk. Thread-safe.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/log.h"
#include "common/base/result.h"
#include "common/net/connection.h"
#include "common/net/endpoint.h"
#include "common/net/tls.h"
#include "proto/session.pb.h"
#include "server-model/access/audit.h"
#include "server-model/access/permissions.h"
#include "server-model/access/roles.h"

namespace handloft::access {

struct GateOptions {
  /// Of plain TCP, which knows no users: whoever reaches the port has it. Editor, as scripts on this host
  /// need.
  v1::Role tcp_role = v1::ROLE_EDITOR;
  /// Days that a device's certificate is good for; then it must be paired again.
  int certificate_days = 730;
  /// Wrong codes of one address in a minute; more are not even looked at.
  std::uint32_t wrong_codes_per_minute = 5;
  /// Wrong codes of all addresses in a minute. Many, so that strangers cannot keep a guest from being paired:
  /// what keeps guesses from hitting is the length of codes and the attempts of each invitation.
  std::uint32_t wrong_codes_per_minute_in_all = 300;
  AuditLimits audit = {};
  std::function<std::int64_t()> now_ns = {};  ///< Since 1970, UTC; empty: the system's clock.
  /// The login name of a user id; empty: the system's.
  std::function<std::string(std::uint32_t uid)> login_of = {};
  std::optional<std::uint32_t> own_uid = {};  ///< Whose server it is; nullopt: this process's.
};

class Gate {
 public:
  /// Without users: unix: peers are owners (net::check_peer() lets only our own user and root in), tcp: peers
  /// have the TCP role, tls: ones are refused. Nothing is written.
  static std::shared_ptr<Gate> without_file(GateOptions options = {});
  /// With the users of an access file, which is made when missing. Errors: those of
  /// AccessFile::open().
  static Result<std::shared_ptr<Gate>> open(const std::filesystem::path& file, GateOptions options,
                                            Logger log);
  ~Gate();
  Gate(const Gate&) = delete;
  Gate& operator=(const Gate&) = delete;

  /// Who a peer is. unix: the login name of its user id; tls: the user of the device whose certificate it has
  /// shown; tcp: "tcp". Errors: permission_denied, and an audit entry, for unknown and revoked devices and
  /// users and for whoever has no role on any model.
  Result<User> authenticate(const net::PeerInfo& peer, net::Endpoint::Kind kind);
  /// The greatest role that the user has there now; ROLE_UNSPECIFIED: none. The server's own user and root
  /// are owners everywhere.
  v1::Role role_of(const User& user, std::string_view model) const;
  /// The role of a client that comes to a model with a Hello that asked for one. Errors: permission_denied
  /// naming the role that the user has, with an audit entry.
  Result<v1::Role> enter(const User& user, std::string_view model, v1::Role asked);
  /// The server's own user and root by a unix socket: who may name any file of the host.
  bool owns_host(const User& user) const;
  /// False when the user or the device has been revoked since: to be closed.
  bool still_welcome(const User& user) const;

  /// As the functions of permissions.h, with an audit entry for a refusal.
  Status check(const User& user, std::string_view model, v1::Role role, const v1::Operation& operation,
               Ownership whose);
  Status check(const User& user, std::string_view model, v1::Role role, const v1::Query& query);
  Status check(const User& user, std::string_view model, v1::Role role, v1::Envelope::BodyCase message);

  /// Into the audit log, soon, and at most AuditLimits::per_peer_per_minute of each user.
  void audit(const AuditEvent& event);
  void joined(const User& user, std::string_view model, v1::Role role, std::string_view program);
  void left(const User& user, std::string_view model, std::string_view reason);

  /// A new device. `done` is called once, from this or another thread. Errors: permission_denied for a wrong,
  /// used or expired code; resource_exhausted after too many wrong ones; invalid_argument for a bad request.
  using PairingDone = std::function<void(Result<v1::Paired>)>;
  void pair(const v1::Pair& request, const std::string& address, PairingDone done);

  /// To be called a few times a second: looks whether the file was changed by others (`handloft-modeld
  /// revoke`). True: roles, users or devices are others now, so that peers must be looked at anew with
  /// still_welcome() and role_of().
  bool poll();

  /// For a tls: endpoint: the authority's certificate and one of the server's own. Peers without a
  /// certificate come through, to be paired. Errors: failed_precondition without a file.
  Result<std::shared_ptr<const net::TlsContext>> server_tls() const;

  /// Other limits, role by TCP and days of certificates from now on; who is there already is told by the next
  /// poll(). Clock, names and whose server it is stay as they were.
  void set_options(const GateOptions& options);

  /// Waits until what is to be written is on the disk: for tests and the end.
  void flush();
  /// Whether there are users at all: open() rather than without_file().
  bool has_users() const;

 private:
  struct Implementation;
  explicit Gate(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace handloft::access
