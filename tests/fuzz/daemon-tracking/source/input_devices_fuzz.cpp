// T1, T9: any bytes as a 3D mouse's report, as a pen's facts and events, as a HID report descriptor, as a
// glove's range and output: a value in range or an error, and what is accepted is written back as the very
// same bytes. The first byte says which.

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "daemon-tracking/fusion/pen_tracker.h"
#include "daemon-tracking/fusion/space_mouse_tracker.h"
#include "daemon-tracking/source/glove_report.h"
#include "daemon-tracking/source/hid/report_descriptor.h"
#include "daemon-tracking/source/pen/pen_events.h"
#include "daemon-tracking/source/pen/pen_streams.h"

using namespace handloft;
using namespace handloft::tracking;

namespace {

void same(std::span<const std::uint8_t> bytes, std::span<const std::uint8_t> again) {
  if (!std::equal(bytes.begin(), bytes.end(), again.begin(), again.end())) std::abort();
}

void space_mouse(std::span<const std::uint8_t> bytes) {
  SpaceMouseTracker tracker;
  // Reports of 13 bytes each.
  for (std::size_t at = 0; at < bytes.size(); at += 13) {
    const auto report = bytes.subspan(at, std::min<std::size_t>(13, bytes.size() - at));
    (void)tracker.consume(DeviceBytes{from_ns(static_cast<std::int64_t>(at) * 1'000'000),
                                      DeviceData::space_mouse_report,
                                      {report.begin(), report.end()}});
    FusedSpaceMouse mouse;
    tracker.describe(mouse);
    if (!(mouse.translation.cwiseAbs().maxCoeff() <= 1.0) || !(mouse.rotation.cwiseAbs().maxCoeff() <= 1.0))
      std::abort();
  }
}

void pen(std::span<const std::uint8_t> bytes, const PenFacts& facts) {
  PenTracker tracker;
  if (!tracker.consume(DeviceBytes{from_ns(0), DeviceData::pen_facts, encode_pen_facts(facts)})) std::abort();
  const auto events = parse_pen_events(bytes);
  if (events) same(bytes, encode_pen_events(*events));
  const bool good =
      tracker
          .consume(DeviceBytes{from_ns(1'000'000'000), DeviceData::pen_events, {bytes.begin(), bytes.end()}})
          .ok();
  if (good != events.ok()) std::abort();
  FusedPen state;
  tracker.describe(state);
  if (!state.position_m.allFinite() || !state.tilt_rad.allFinite() ||
      !(state.pressure >= 0.0 && state.pressure <= 1.0))
    std::abort();
  if (state.time > from_ns(1'000'000'000)) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::span<const std::uint8_t> bytes(data + 1, size - 1);
  switch (data[0] % 6) {
    case 0:
      space_mouse(bytes);
      break;
    case 1:
      pen(bytes, simulated_pen_facts());
      break;
    case 2: {
      // Facts, then events.
      constexpr std::size_t facts_size = 66;
      if (bytes.size() < facts_size) break;
      const auto facts = parse_pen_facts(bytes.first(facts_size));
      if (!facts) break;
      same(bytes.first(facts_size), encode_pen_facts(*facts));
      pen(bytes.subspan(facts_size), *facts);
      break;
    }
    case 3:
      if (const auto reports = parse_report_descriptor(bytes)) {
        for (const auto& [id, bits] : reports->input_bits)
          if (HidReports::bytes(reports->input_bits, id) > 65536u) std::abort();
      }
      break;
    case 4:
      if (const auto range = parse_glove_range(bytes)) same(bytes, encode_glove_range(*range));
      break;
    case 5:
      if (const auto output = parse_glove_output(bytes)) same(bytes, encode_glove_output(*output));
      break;
    default:
      break;
  }
  return 0;
}
