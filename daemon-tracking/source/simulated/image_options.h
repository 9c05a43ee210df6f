#pragma once
// How a simulated camera turns light into bytes.

namespace handloft::tracking {

struct ImageOptions {
  double exposure_s = 0.006;  ///< Webcams in room light with exposure locked (tracking.md 5.4: 5..8 ms).
  double row_time_s =
      0.0;  ///< Of a rolling shutter: from row to row; its frames are told by their middle row.
  double noise_luma = 2.0;  ///< Standard deviation in grey levels.
  double noise_chroma = 1.2;
  double blur_px = 0.6;     ///< Standard deviation of the lens's point spread.
  double brightness = 1.0;  ///< Factor on all luma: tests of light that changes.
  int jpeg_quality = 90;
};

}  // namespace handloft::tracking
