#pragma once
// The file of a server's people (U2): its authority with its private key, users, their devices, roles, open
// invitations, and the audit log. One SQLite file (WAL, synchronous=FULL), 0600: whoever can read it can sign
// certificates. The commands of handloft-modeld change it beside a running server, which watches it
// (Gate::poll()). One thread uses an AccessFile at a time; several may have the same file open.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/net/certificates.h"
#include "proto/session.pb.h"
#include "server-model/access/audit.h"
#include "server-model/access/roles.h"
#include "server-model/store/database.h"

namespace handloft::access {

/// Seconds since 1970, UTC.
using Seconds = std::int64_t;

struct Grant {
  std::string model;  ///< Or every_model.
  v1::Role role = v1::ROLE_UNSPECIFIED;
};

struct Device {
  std::string fingerprint;  ///< SHA-256 of its certificate.
  std::string user;
  std::string name;  ///< "Ann's headset"
  Seconds paired_s = 0;
  Seconds until_s = 0;    ///< When its certificate ends.
  Seconds revoked_s = 0;  ///< 0: never.
};

struct Person {
  std::string name;
  Seconds made_s = 0;
  Seconds revoked_s = 0;  ///< 0: never.
  std::vector<Grant> grants;
};

/// What they may do on a model: the greater of what they have on it and on every one; nothing once revoked.
v1::Role granted(const Person& person, std::string_view model);

struct OpenInvitation {
  std::string user;
  std::string model;
  v1::Role role = v1::ROLE_UNSPECIFIED;
  Seconds until_s = 0;
  int attempts_left = 0;
};

/// Everybody, as they are now.
struct Register {
  std::uint64_t generation = 0;  ///< Grows whenever anything else of it changes.
  std::vector<Person> people;    ///< By name.
  std::vector<Device> devices;   ///< Oldest first.
  std::vector<OpenInvitation> invitations;
};

struct Invite {
  std::string user;  ///< 1 to 64 bytes without control characters; no "*".
  v1::Role role = v1::ROLE_UNSPECIFIED;
  std::string model{every_model};
  Seconds valid_s = Seconds{15} * 60;  ///< 1 minute to 7 days.
};

struct PairedDevice {
  std::string certificate_pem;
  Device device;
  v1::Role role = v1::ROLE_UNSPECIFIED;  ///< That the user now has on the model of the invitation.
  std::string model;
};

/// What a revocation, or a role of none, has taken from somebody.
struct Withdrawn {
  bool user = false;  ///< A user until then; false: revoked before, or never one.
  int devices = 0;
  int roles = 0;
  int invitations = 0;
};

/// "2 devices, 1 role, 1 invitation"; "nothing".
std::string in_words(const Withdrawn& taken);

/// Wrong secrets with the right number, after which an invitation is void.
inline constexpr int attempts_per_invitation = 5;

class AccessFile {
 public:
  enum class Mode { existing, create };

  /// `create` makes a missing file, its folder (0700), and an authority that is good for 30 years. Errors:
  /// not_found, permission_denied when group or others may read it; data_corrupt for what is no such file or
  /// a damaged one; unsupported for one of a later version; io.
  static Result<AccessFile> open(const std::filesystem::path& path, Mode mode, Seconds now_s);
  /// $XDG_STATE_HOME/handloft/server.sqlite, or ~/.local/state/...; `create` makes its folder, 0700. Errors:
  /// not_found, io.
  static Result<std::filesystem::path> default_path(Mode mode);

  const net::CertificateAuthority& authority() const { return authority_; }
  const std::string& authority_fingerprint() const { return fingerprint_; }

  /// Errors: data_corrupt, io.
  Result<Register> read() const;
  /// Whether somebody else has written since the last call; reads nothing from the disk when not.
  Result<bool> touched();
  Result<std::uint64_t> generation() const;

  /// The code (net::write_pairing_code()), which is kept nowhere. Errors: invalid_argument;
  /// resource_exhausted with more than a thousand open ones.
  Result<std::string> invite(const Invite& invite, Seconds now_s);
  /// A name that nobody has becomes a user, for people of this host. ROLE_UNSPECIFIED takes away the role on
  /// that model and the invitations to it, which would give it back. Errors: invalid_argument; not_found when
  /// there is nothing to take away.
  Result<Withdrawn> set_role(const std::string& user, const std::string& model, v1::Role role, Seconds now_s);
  /// A user with all devices, roles and invitations; also somebody who is only invited. Errors: not_found for
  /// a name that has none of these.
  Result<Withdrawn> revoke_user(const std::string& user, Seconds now_s);
  /// By the fingerprint or its beginning of 8 digits or more. Returns the device. Errors: not_found;
  /// invalid_argument when several begin so.
  Result<Device> revoke_device(const std::string& fingerprint, Seconds now_s);

  /// Errors: permission_denied for a code that is wrong, used, expired or void, the same words for all; that
  /// of the request: invalid_argument, data_corrupt.
  struct Request {
    std::string code;
    std::string certificate_request;
    std::string device;
    int certificate_days = 730;
  };
  Result<PairedDevice> pair(const Request& request, Seconds now_s);

  /// In one transaction; the oldest beyond `most` go.
  Status add_audit(const std::vector<AuditEvent>& events, std::int64_t now_ns, std::uint32_t most);
  /// The newest `count`, oldest first.
  Result<std::vector<AuditEntry>> audit(std::uint32_t count) const;

 private:
  AccessFile(store::Database database, net::CertificateAuthority authority, std::string fingerprint);
  /// What `change` does, with a new generation and the event, or nothing of it.
  Status change(const std::function<Status()>& what, const AuditEvent& event, Seconds now_s);
  /// Runs a change with these as ?1, ?2, ...; how many rows it met.
  Result<int> change_rows(const std::string& sql, std::initializer_list<std::string_view> texts);
  Status insert_audit(const AuditEvent& event, std::int64_t now_ns);
  Result<Withdrawn> take_role(const std::string& user, const std::string& model);
  Error nothing_to_take(const std::string& user, const std::string& model) const;
  Status put_role(const std::string& user, const std::string& model, v1::Role role);
  Status put_user(const std::string& user, Seconds now_s);
  Status after_commit();

  store::Database database_;
  net::CertificateAuthority authority_;
  std::string fingerprint_;
  std::int64_t data_version_ = -1;
};

}  // namespace handloft::access
