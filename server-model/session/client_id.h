#pragma once
// Who a client is across connections (U1, U3): one that keeps a random key to itself (Hello.client_key) has
// the same number whenever it comes, so that it may undo what it did, retry what it does not know of, and
// resume. No table is kept of that: the number is derived.

#include <cstdint>
#include <string_view>

namespace handloft::session {

/// Numbers that a server counts are below, derived ones at or above.
inline constexpr std::uint64_t first_derived_client_id = std::uint64_t{1} << 52U;
/// A key is so long, or there is none.
inline constexpr std::size_t min_client_key_bytes = 16;
inline constexpr std::size_t max_client_key_bytes = 64;

/// The first 53 bits of SHA-256(user, 0, key) with bit 52 set: a double holds it (JSON, scripts). Another
/// user with the same key is another client.
std::uint64_t derived_client_id(std::string_view user, std::string_view key);

}  // namespace handloft::session
