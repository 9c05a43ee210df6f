#pragma once
// Which cameras there are, what they can do, and which of them is meant (T1, T2). A camera is known by where
// it is plugged in and by its serial number, never by its /dev/videoN, which changes with every plug.

#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "daemon-tracking/source/camera/v4l2_modes.h"
#include "daemon-tracking/source/camera/v4l2_system.h"

namespace handloft::tracking {

struct V4l2CameraInfo {
  V4l2Node node;
  std::string model;   ///< QUERYCAP's card; what a calibration is bound to together with serial and mode.
  std::string driver;  ///< "uvcvideo", "vivid"
  std::string bus_info;
  std::string identity;  ///< identity_of(node)
  std::vector<VideoSize> sizes;
  /// Why the daemon can't use it, in words ("multi-planar interface"); empty for a usable one.
  std::string unusable;
};

/// All capture nodes, usable or not; metadata and output nodes are left out (device_caps). A node that can't
/// be opened is listed as unusable with the reason and the remedy.
std::vector<V4l2CameraInfo> list_v4l2_cameras(V4l2System& system);
std::vector<V4l2CameraInfo> list_v4l2_cameras();

/// One line that stays the same over restarts: "046d:082d serial 3F2A at pci-0000:00:14.0-usb-0:3:1.0"; parts
/// that are not known are left out, the name stands in when nothing is.
std::string identity_of(const V4l2Node& node);

/// Which camera is meant: each part that is not empty has to fit.
struct CameraSelector {
  std::string path, serial, usb_id, model, node;
};

/// "serial=3F2A", "path=pci-...,usb=046d:082d", "model=HD Pro Webcam C920", "node=/dev/video0", or a bare
/// "/dev/video0" or "/dev/v4l/by-path/..." . Errors: invalid_argument naming the key.
Result<CameraSelector> parse_camera_selector(std::string_view text);
std::string to_string(const CameraSelector& selector);

/// What to do about a camera that has the right serial number in another socket, or the other way round.
enum class IdentityMismatch {
  refuse,        ///< Say so; the person confirms by changing the selector.
  accept_moved,  ///< The same serial number elsewhere is the same camera; another one in its place is
                 ///< refused.
};

struct NodeMatch {
  std::vector<V4l2Node> nodes;  ///< Of that one camera: capture and metadata; lowest number first.
  std::string note;             ///< "moved from ... to ..." in words, or empty.
};

/// Finds the camera without opening it. Errors: not_found (nothing fits; names what there is),
/// failed_precondition (another camera where this one was, or more than one fits).
Result<NodeMatch> match_camera(const std::vector<V4l2Node>& nodes, const CameraSelector& selector,
                               IdentityMismatch mismatch);

}  // namespace handloft::tracking
