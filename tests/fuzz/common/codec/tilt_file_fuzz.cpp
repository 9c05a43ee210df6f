// The .tilt parser on arbitrary bytes, both as a whole file and as the inner binary (which the checksum of
// the archive would otherwise shield).

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "common/codec/tilt_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace handloft::codec;
  const auto bytes = std::as_bytes(std::span(data, size));
  const TiltLimits limits{.max_file_bytes = std::size_t{1} << 20,
                          .max_uncompressed_bytes = std::size_t{1} << 20,
                          .max_strokes = 10'000,
                          .max_points = 100'000};
  (void)parse_tilt(bytes, limits).ok();
  const auto sketch = parse_tilt_sketch(bytes, limits);
  if (!sketch.ok()) return 0;
  if (sketch->point_count() > limits.max_points) std::abort();
  for (const TiltStroke& stroke : sketch->strokes) {
    for (const TiltControlPoint& point : stroke.points) {
      if (!(point.pressure >= 0 && point.pressure <= 1) || !std::isfinite(point.position[0])) std::abort();
    }
  }
  return 0;
}
