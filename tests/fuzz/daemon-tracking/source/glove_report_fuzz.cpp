// T9: any bytes are a report or an error; a report that is accepted is written back as the very same bytes.

#include <algorithm>
#include <cstdlib>

#include "daemon-tracking/source/glove_report.h"

using namespace handloft::tracking;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::uint8_t> bytes(data, size);
  const auto report = parse_glove_report(bytes);
  if (report) {
    const auto again = encode_glove_report(*report);
    if (!std::equal(bytes.begin(), bytes.end(), again.begin(), again.end())) std::abort();
  }
  // The checksum hides the fields from the fuzzer: put the right one in and try again.
  if (size == glove_report_size) {
    GloveReport fields;
    fields.flags = static_cast<std::uint16_t>(data[2] | data[3] << 8);
    fields.force = static_cast<std::uint16_t>(data[10] | data[11] << 8);
    fields.potentiometer = static_cast<std::uint16_t>(data[12] | data[13] << 8);
    fields.contacts = static_cast<std::uint16_t>(data[14] | data[15] << 8);
    fields.battery_percent = data[16];
    const auto parsed = parse_glove_report(encode_glove_report(fields));
    const bool good = fields.flags <= glove_flags_all && fields.force <= glove_analogue_max &&
                      fields.potentiometer <= glove_analogue_max && fields.contacts <= contact_all &&
                      fields.battery_percent <= 100;
    if (parsed.ok() != good) std::abort();
  }
  return 0;
}
