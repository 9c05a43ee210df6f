#pragma once
// The fused state as the message that subscribers get (T14): one atomic TrackingFrame per observation.

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "daemon-tracking/fusion/fused_state.h"
#include "daemon-tracking/source/rig.h"
#include "proto/tracking.pb.h"

namespace handloft::tracking {

/// A camera's newest frame, as far as viewers need it to draw over its picture (V1).
struct ShownFrame {
  std::uint32_t camera = 0;
  TimePoint exposure_time;
  Eigen::Isometry3d world_from_camera = Eigen::Isometry3d::Identity();
  TrackingState state = TrackingState::lost;
};

struct DeviceReport {
  std::string device;  ///< "camera/left", "glove"
  bool present = false;
  double rate_hz = 0.0;
  std::uint64_t samples = 0;
  std::uint64_t dropped = 0;
  TimePoint last_sample;
  std::string problem;
  std::string identity;        ///< Model, serial number, port.
  double asked_rate_hz = 0.0;  ///< 0: as it comes.
  std::uint64_t refused = 0;   ///< Samples that could not be used.
};

/// Fills `frame` (cleared first; its memory is reused) with what moves: hand, head and the pose of the camera
/// whose observation made the state. Everything but the publish time and the standing parts.
/// A hand on the table (T10) is the gesture ON_TABLE whatever its fingers do, when the glove's table pad says
/// so. Pen and 3D mouse are left out while there never was one.
void fill_tracking_frame(const FusedState& state, const Rig& rig, const std::vector<ShownFrame>& shown,
                         v1::TrackingFrame& frame);

/// Adds what hardly ever changes and is therefore told only now and then, so that frames are small: all
/// cameras with names and lenses, the devices' health and the fingertips' colours.
void add_standing_parts(const Rig& rig, const std::vector<ShownFrame>& shown,
                        const std::vector<DeviceReport>& devices, v1::TrackingFrame& frame);

/// Gives `to`, which has none, the standing parts of an earlier frame, so that it can be somebody's first.
/// Its own cameras keep their poses.
void copy_standing_parts(const v1::TrackingFrame& from, v1::TrackingFrame& to);
bool has_standing_parts(const v1::TrackingFrame& frame);

/// A cap's colour as 0x00RRGGBB in sRGB.
std::uint32_t srgb_of(const FingertipColour& colour);

}  // namespace handloft::tracking
