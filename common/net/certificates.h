#pragma once
// Who is who between hosts (U2): a model server is its own small certificate authority. It signs one
// certificate for itself and one for each person's device that was paired with it; nobody else's word counts.
// Keys are Ed25519 (RFC 8410), certificates X.509 v3 (RFC 5280), all as PEM. Times are seconds since 1970,
// UTC. OpenSSL does the work.

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "common/base/result.h"

namespace handloft::net {

/// A private key and the certificate that belongs to it.
struct TlsIdentity {
  std::string certificate_pem;
  std::string key_pem;
};

/// How long something may be used.
struct Validity {
  std::int64_t from_s = 0;
  std::int64_t until_s = 0;
};

/// What a certificate says; whether to believe it is another matter.
struct CertificateFacts {
  std::string name;         ///< The subject's common name.
  std::string serial;       ///< Lower-case hexadecimal.
  std::string fingerprint;  ///< SHA-256 of the whole certificate, lower-case hexadecimal.
  Validity validity;
};

/// What every server's certificate is for, whatever its host is called: clients know a server by its
/// authority.
inline constexpr std::string_view tls_server_name = "modeld.handloft.invalid";

/// A new private key. Errors: internal.
Result<std::string> make_key();
/// A request to sign (PKCS #10) for the key's public half. Errors: invalid_argument for what is no key; a
/// name that is empty or has more than 64 bytes or control characters.
Result<std::string> make_certificate_request(const std::string& key_pem, const std::string& name);
/// Errors: data_corrupt for what is no certificate.
Result<CertificateFacts> read_certificate(const std::string& certificate_pem);

class CertificateAuthority {
 public:
  /// A new one, which signs itself. Errors: as make_certificate_request() for the name.
  static Result<CertificateAuthority> create(const std::string& name, Validity validity);
  /// One that was kept. Errors: data_corrupt when the certificate is none of an authority, or the key is not
  /// its own.
  static Result<CertificateAuthority> load(const TlsIdentity& identity);

  const TlsIdentity& identity() const { return identity_; }

  /// For the server itself, with a key of its own, so that the authority's may lie elsewhere.
  Result<TlsIdentity> issue_server(Validity validity) const;
  /// For whoever holds the key of the request; the request's own name is not believed, `name` is signed.
  /// Errors: data_corrupt for what is no request or not signed by its own key; invalid_argument for the name,
  /// or for a key of another kind than make_key()'s.
  Result<std::string> issue_client(const std::string& request_pem, const std::string& name,
                                   Validity validity) const;

 private:
  explicit CertificateAuthority(TlsIdentity identity) : identity_(std::move(identity)) {}
  TlsIdentity identity_;
};

}  // namespace handloft::net
