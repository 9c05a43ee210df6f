#pragma once
// TLS 1.3 (RFC 8446), and nothing older, over a connected socket (U2, A1, A2). A server believes certificates
// that its own authority signed for clients; a client believes the one authority that it was paired with, or
// for the pairing itself the one whose fingerprint the code names. Certificates of others, expired ones,
// those of clients in a server's place and none at all are refused in the handshake, before a byte of ours is
// read.

#include <memory>
#include <optional>
#include <string>

#include "common/net/byte_stream.h"
#include "common/net/certificates.h"

namespace handloft::net {

/// Whom a server lets speak.
enum class TlsClients {
  known,        ///< With a certificate of the authority.
  also_unknown  ///< Also without one: for pairing; ByteStream::peer() tells.
};

/// Keys, certificates and rules, shared by connections. Thread-safe.
class TlsContext {
 public:
  /// Errors: data_corrupt for what is no certificate or key, or when the key is another's.
  static Result<std::shared_ptr<const TlsContext>> for_server(const TlsIdentity& server,
                                                              const std::string& authority_pem,
                                                              TlsClients clients);
  /// As a paired client. Errors: the same.
  static Result<std::shared_ptr<const TlsContext>> for_client(const TlsIdentity& client,
                                                              const std::string& authority_pem);
  /// Without a certificate, to be paired: the server must show the authority with this fingerprint
  /// (CertificateFacts::fingerprint, or its beginning of at least 32 digits). Errors: invalid_argument.
  static Result<std::shared_ptr<const TlsContext>> for_pairing(const std::string& authority_fingerprint);
  ~TlsContext();
  TlsContext(const TlsContext&) = delete;
  TlsContext& operator=(const TlsContext&) = delete;

  /// A stream over `fd`, a connected non-blocking socket that outlives it. The handshake is made by the first
  /// reads and writes, on either side. Errors: internal.
  Result<std::unique_ptr<ByteStream>> open(int fd) const;

  /// The authority's certificate that a server showed, for a pairing client to keep; empty before the
  /// handshake is over.
  static std::string shown_authority(const ByteStream& stream);

 private:
  struct Implementation;
  explicit TlsContext(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace handloft::net
