#pragma once
// Addresses of peers, for limits: one host may have as many IPv6 addresses of its network as it likes.

#include <string>

namespace handloft::net {

/// What limits by address count: an IPv4 address as it is, of an IPv6 one its /64 ("2001:db8:1:2::/64"); any
/// other text as it is.
std::string limited_address(const std::string& address);

}  // namespace handloft::net
