// Bytes as TrackingFrames of a hostile daemon, one after another, then questions about every time near and
// far: never a crash, an overflow, a number that is none, or memory without bound. Two bytes (little-endian)
// before each piece say how long it is, eight before all of them how far apart the two clocks are.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include "client-hmd/view/tracking_feed.h"

namespace {

using namespace handloft;
using namespace handloft::client;

void require(bool condition) {
  if (!condition) std::abort();
}

bool finite(const glm::dvec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

void check(const std::optional<PoseAnswer>& answer) {
  if (!answer) return;
  require(finite(answer->pose.position));
  require(std::abs(glm::length(answer->pose.orientation) - 1.0) < 1e-2);
}

void ask(const TrackingHistory& history, TimePoint time) {
  check(history.head_at(time));
  for (const FilmCamera& camera : history.status().cameras) check(history.camera_at(camera.index, time));
  for (const auto& finger : history.fingers_at(time)) require(!finger || finite(finger->position));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::int64_t offset_ns = 0;
  if (size < sizeof(offset_ns)) return 0;
  std::memcpy(&offset_ns, data, sizeof(offset_ns));
  data += sizeof(offset_ns);
  size -= sizeof(offset_ns);
  // What a handshake lets through: half of the difference of times up to 2^60.
  offset_ns %= std::int64_t{1} << 60;
  TrackingHistory history;
  constexpr std::size_t header = 2;
  while (size >= header) {
    const std::size_t wanted = data[0] + 256U * data[1];
    const std::size_t length = std::min(wanted, size - header);
    v1::TrackingFrame frame;
    if (frame.ParseFromArray(data + header, static_cast<int>(length))) {
      history.add(frame, Duration(offset_ns), from_ns(1'000'000'000));
      const TrackingStatus& status = history.status();
      require(status.cameras.size() <= 16);
      for (const FilmCamera& camera : status.cameras) {
        require(check_pinhole(camera.pinhole).ok() && camera.name.size() <= 64);
      }
      if (status.hand) require(status.hand->pressure >= 0.0 && status.hand->pressure <= 1.0);
      for (const std::int64_t ahead_ns :
           {-1'000'000'000LL, -1LL, 0LL, 8'000'000LL, 200'000'000LL, 5'000'000'000LL}) {
        ask(history, status.capture_time + Duration(ahead_ns));
      }
      ask(history, from_ns(0));
      ask(history, from_ns(std::int64_t{1} << 60));
    }
    data += header + length;
    size -= header + length;
  }
  history.clear();
  ask(history, from_ns(1'000'000'000));
  return 0;
}
