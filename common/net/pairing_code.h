#pragma once
// The one-time code by which a device is paired with a server (U2): the first 128 bits of the SHA-256
// fingerprint of the server's authority, so that the device knows whom it talks to before anything is
// believed, and 60 secret bits. As 40 signs of Crockford's Base32 in groups of five, for reading aloud: no I,
// L, O, U; the last two signs are a CRC-10 (polynomial 0x233) of the others, which finds every wrong sign and
// every two that were swapped.

#include <cstdint>
#include <string>
#include <string_view>

#include "common/base/result.h"

namespace handloft::net {

struct PairingCode {
  std::string
      authority;  ///< 32 lower-case hexadecimal digits: the beginning of CertificateFacts::fingerprint.
  std::uint64_t secret = 0;  ///< 60 bits.
  bool operator==(const PairingCode&) const = default;
};

inline constexpr std::uint64_t pairing_secrets = std::uint64_t{1} << 60;
inline constexpr std::size_t pairing_authority_digits = 32;

/// "04G2X-...": 47 bytes. Precondition: `authority` holds 32 hexadecimal digits, `secret` 60 bits.
std::string write_pairing_code(const PairingCode& code);
/// Small letters, spaces, hyphens, O for 0, I and L for 1 are understood. Errors: invalid_argument (field
/// "code") for other signs, another length, and a code whose last two signs don't fit: mistyped.
Result<PairingCode> read_pairing_code(std::string_view text);

}  // namespace handloft::net
