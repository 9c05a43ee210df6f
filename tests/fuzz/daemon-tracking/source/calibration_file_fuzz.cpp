// Any text as a calibration file: refused, or read into values that are within their ranges and are written
// and read again.

#include <cstdlib>

#include "daemon-tracking/source/calibration_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace handloft::tracking;
  const auto read = parse_calibration({reinterpret_cast<const char*>(data), size}, "fuzz.toml");
  if (!read) return 0;
  if (!check_calibration(*read).ok()) std::abort();
  const auto text = format_calibration(*read);
  if (!text.ok() || !parse_calibration(*text, "again.toml").ok()) std::abort();
  return 0;
}
