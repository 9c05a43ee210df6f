#pragma once
// CRC-32C (Castagnoli, polynomial 0x1EDC6F41 reflected, as in iSCSI, RFC 3720 appendix B.4).

#include <cstdint>
#include <span>

namespace handloft::record {

/// Of `bytes`, going on from `crc` of what came before (0 at the beginning).
std::uint32_t crc32c(std::span<const std::uint8_t> bytes, std::uint32_t crc = 0);

}  // namespace handloft::record
