#pragma once
// Scripts of camera paths (V8), as TOML. Every error names file, line and field; nothing is ignored.
//
//   size = "1920x1080"          # WIDTHxHEIGHT; default 1280x720
//   rate = 30                   # pictures a second
//   supersampling = 2           # 1..4 pixels a side for each of the picture
//   easing = "smooth"           # or "linear"
//   loop = false                # true: the last key is where it begins anew
//   background = "studio"       # or "transparent"
//   stereo = false              # true: two eyes side by side, each of the size
//   eye_distance = 0.063        # metres
//
//   [[key]]                     # where the camera is; one at least
//   time = 0                    # seconds, growing; the first is 0
//   target = "scene"            # the middle of all that is shown, or [x, y, z] in metres; default "scene"
//   orbit = { azimuth = -80, elevation = 25, distance = 0.6 }   # degrees, metres; distance absent: all is
//   seen field_of_view = 28.6        # degrees, vertical
//
//   [[key]]
//   time = 4
//   eye = [0.3, -0.5, 0.3]      # instead of an orbit: where the camera is, metres
//
//   [[change]]                  # what is shown, from a time on
//   time = 2
//   show = "surface"            # "points", "surface" or "both", of shapes that have both
//   shading = "zebra"           # "studio", "clay", "car-paint", ...: as --shading

#include <filesystem>
#include <string>
#include <string_view>

#include "client-hmd/shots/shot_plan.h"
#include "common/base/result.h"

namespace handloft::client {

struct ShotLimits {
  std::size_t max_file_bytes = std::size_t{1} << 20;
  std::size_t max_keys = 1000;
  std::size_t max_changes = 1000;
  double max_duration_s = 3600.0;
  std::size_t max_frames = 100'000;  ///< An hour at 25 a second has 90,000.
};

/// `file_name` is for the messages. Errors: invalid_argument with the field ("key[1].orbit.distance") and, in
/// the message, file and line; resource_exhausted for more than the limits.
Result<ShotPlan> parse_shot_script(std::string_view text, const std::string& file_name,
                                   const ShotLimits& limits = {});

/// Errors also: not_found, io.
Result<ShotPlan> read_shot_script(const std::filesystem::path& path, const ShotLimits& limits = {});

}  // namespace handloft::client
