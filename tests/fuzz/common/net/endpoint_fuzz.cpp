// Any text as an endpoint: what is accepted is written and read the same.

#include <cstdlib>

#include "common/net/endpoint.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace handloft::net;
  const auto endpoint = parse_endpoint({reinterpret_cast<const char*>(data), size});
  if (!endpoint) return 0;
  const auto again = parse_endpoint(endpoint->to_string());
  if (!again || !(*again == *endpoint)) std::abort();
  return 0;
}
