#pragma once
// The servers that this device was paired with (U2): a folder for each under
// $XDG_CONFIG_HOME/handloft/servers, named by the fingerprint of its authority, 0700, its files 0600:
//
//   key.pem          this device's private key, made here; it never leaves
//   certificate.pem  what the server's authority signed for it
//   authority.pem    the authority: who is believed to be that server, whatever its host is called
//   server.json      where it was last found, and as whom we were paired

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/net/certificates.h"
#include "common/net/endpoint.h"
#include "common/net/tls.h"

namespace handloft::net {

struct PairedServer {
  std::string authority_fingerprint;  ///< 64 hexadecimal digits; the folder's name.
  std::string endpoint;               ///< "tls:studio.example:7401"
  std::string user;                   ///< Who we are there,
  std::string role;                   ///< and what we were invited as.
  TlsIdentity identity;
  std::string authority_pem;
};

/// $XDG_CONFIG_HOME/handloft/servers, or ~/.config/...; made, with 0700, when something is saved. Errors:
/// not_found without HOME.
Result<std::filesystem::path> paired_servers_folder();

struct PairingOptions {
  std::string device;  ///< What to call this device: "Ann's headset"; empty: the host's name.
  std::chrono::milliseconds timeout{10'000};
};

/// Makes a key, shows the code to the server that the code names, and keeps what it answers in `folder`.
/// Nothing is kept when it fails. Errors: those of read_pairing_code(); the server's refusal
/// (permission_denied for a wrong, used or expired code); io when the server is not the one that the code
/// names; not_found, timeout when nobody listens.
Result<PairedServer> pair(const Endpoint& endpoint, std::string_view code, const PairingOptions& options,
                          const std::filesystem::path& folder);

/// All in `folder`; those that cannot be read are left out. An absent folder holds none.
std::vector<PairedServer> paired_servers(const std::filesystem::path& folder);
/// The one at that endpoint; where none was last found there but only one is known at all, that one. Errors:
/// failed_precondition with what to do; permission_denied when others may read the key.
Result<PairedServer> find_paired_server(const Endpoint& endpoint, const std::filesystem::path& folder);

/// What ClientOptions::tls needs for an endpoint: null for unix: and tcp:. Errors: those of
/// find_paired_server() in paired_servers_folder(), and of TlsContext::for_client().
Result<std::shared_ptr<const TlsContext>> tls_to(const Endpoint& endpoint);

}  // namespace handloft::net
