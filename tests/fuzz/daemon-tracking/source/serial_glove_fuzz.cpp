// T9: any bytes from a serial line are lines or errors; an accepted line is read again as the same values,
// and what it means stays in range.

#include <cstdlib>

#include "daemon-tracking/fusion/serial_glove_mapper.h"
#include "daemon-tracking/source/glove/serial_glove_line.h"

using namespace handloft::tracking;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  LineCutter cutter;
  SerialGloveMapper mapper;
  cutter.feed({data, size}, [&](std::span<const std::uint8_t> bytes) {
    const auto line = parse_serial_glove_line(bytes);
    if (!line) return;
    const std::string text = encode_serial_glove_line(*line);
    if (!text.empty()) {
      const auto again =
          parse_serial_glove_line({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
      if (!again || !(*again == *line)) std::abort();
    }
    const GloveReport report = mapper.map(*line);
    if (report.force > glove_analogue_max || report.potentiometer > glove_analogue_max ||
        (report.contacts & ~contact_all) != 0)
      std::abort();
  });
  return 0;
}
