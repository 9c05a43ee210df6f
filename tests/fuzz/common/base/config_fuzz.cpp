// Any text as a configuration file: refused or read, and what is read is within its range.

#include <cstdlib>

#include "common/base/config.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  double rate_hz = 30;
  std::int64_t count = 1;
  bool video = true;
  std::string listen;
  std::vector<std::string> views;
  handloft::OptionTable table("fuzz", "");
  table.add("camera.rate_hz", rate_hz, "", {.min = 1, .max = 240});
  table.add("count", count, "", {.min = 0, .max = 10});
  table.add("video", video, "");
  table.add("listen", listen, "");
  table.add("views", views, "");
  static_cast<void>(table.parse_toml({reinterpret_cast<const char*>(data), size}, "fuzz.toml").ok());
  if (!(rate_hz >= 1 && rate_hz <= 240) || count < 0 || count > 10) std::abort();
  return 0;
}
