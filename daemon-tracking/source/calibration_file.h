#pragma once
// The calibration file (T2, T11): everything that handloft-calibrate measured of one lab's cameras, tags,
// fingertip caps and glove, with the devices it belongs to, the date and how good each step came out. One
// TOML text that a person can read; handloft-trackd reads it with --calibration, handloft-calibrate reads,
// completes and writes it. Lengths in metres, times in nanoseconds, image coordinates in pixels.
//
//   version = 1
//   date = "2026-11-22T12:20:00Z"
//   [[camera]]
//   name = "left"                   role = "table"
//   device = { model = "HD Webcam", serial = "4F2A", path = "pci-0000:00:14.0-usb-0:2:1.0" }
//   mode = { width_px = 640, height_px = 480, format = "mjpeg", frames_per_s = 30.0 }
//   lens = { focal_px = [602.0, 601.0], centre_px = [322.4, 237.1], distortion = [-0.1, 0.03, 0.0, 0.0, 0.0]
//   } pose = { position_m = [-0.38, 0.54, 0.4], orientation_wxyz = [...] }   # in the world; head camera: in
//   the head time = { offset_ns = 0, row_ns = 0 } controls = { exposure_100us = 60, gain = 32,
//   white_balance_k = 4600, focus = 0 }   # each may be missing colours.thumb = { y = 95.0, cb = 103.0, cr =
//   217.0, sigma_cb = 10.0, sigma_cr = 10.0 }   # all five or none results.intrinsics = { verdict = "good",
//   residual = 0.21, unit = "px", date = "...", words = "..." }
//   [[table_tag]]  id, edge_m, position_m, orientation_wxyz     ([[head_tag]] likewise, in the head's frame)
//   [fingertips]   radius_m and, for cameras that have none of their own, the five colours
//   [glove]        device, force_zero, force_full, potentiometer_low, potentiometer_high
//   [results]      steps that belong to no single camera: head_rig, glove
//
// A key that is not known, is missing, has another type or a value out of its range is an error that names
// file, line, table and key and what was expected: nothing is ignored and nothing guessed.

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "daemon-tracking/source/rig.h"
#include "daemon-tracking/source/sample.h"

namespace handloft::tracking {

/// Which device it is (T2). `serial` is empty where a device has none; the port's `path` then tells two
/// alike cameras apart.
struct DeviceIdentity {
  std::string model;   ///< As the driver names it; a glove: its USB product string.
  std::string serial;  ///< USB serial number.
  std::string path;    ///< /dev/v4l/by-path without folder and "-video-index0"; a glove: the hub's port.

  bool operator==(const DeviceIdentity&) const = default;
};

enum class Verdict : std::uint8_t { good, usable, bad };
std::string_view to_string(Verdict verdict);

/// How a step of the calibration came out.
struct StepResult {
  Verdict verdict = Verdict::bad;
  double residual = 0.0;  ///< RMS, in `unit`.
  std::string unit = "px";
  std::string date;   ///< ISO 8601, UTC.
  std::string words;  ///< One sentence for a person.

  bool operator==(const StepResult&) const = default;
};

/// The camera's settings under which it was calibrated; nullopt: the camera has no such control.
struct CameraControls {
  std::optional<int> exposure_100us;  ///< V4L2_CID_EXPOSURE_ABSOLUTE.
  std::optional<int> gain;
  std::optional<int> white_balance_k;
  std::optional<int> focus;  ///< A lens that focuses anew is another lens.

  bool operator==(const CameraControls&) const = default;
};

/// What is known of a camera beside its CameraCalibration.
struct CameraRecord {
  DeviceIdentity device;
  PixelFormat format = PixelFormat::mjpeg;
  double frames_per_s = 30.0;
  CameraControls controls;
  std::optional<std::array<FingertipColour, finger_count>> colours;  ///< As this camera sees the caps.
  std::map<std::string, StepResult> results;  ///< By step: "intrinsics", "extrinsics", "time", "colours".
};

/// What the glove's converter says at rest and at its ends, in raw steps 0..1023.
struct GloveRanges {
  DeviceIdentity device;
  double force_zero = 0.0;     ///< Nothing pressed.
  double force_full = 1023.0;  ///< As hard as the user wants to press.
  double potentiometer_low = 0.0;
  double potentiometer_high = 1023.0;

  bool operator==(const GloveRanges&) const = default;
};

struct Calibration {
  std::string date;                   ///< Of the last change, ISO 8601, UTC.
  Rig rig;                            ///< Its cameras carry intrinsics, poses, time offsets and row times.
  std::vector<CameraRecord> cameras;  ///< One per rig.cameras, in the same order.
  std::optional<GloveRanges> glove;
  std::map<std::string, StepResult> results;
};

inline constexpr int calibration_version = 1;
inline constexpr std::size_t max_calibration_bytes = 1u << 20;
inline constexpr std::size_t max_rig_cameras = 16;
inline constexpr std::size_t max_body_tags = 64;  ///< Of the table, and of the head.

/// A rig of which nothing was measured: every camera with an empty identity and no results.
Calibration calibration_of(const Rig& rig);

/// The rig as camera `camera` sees it: with the colours that were learned for it. For CameraTracker::create.
/// Precondition: camera < calibration.rig.cameras.size().
Rig rig_for_camera(const Calibration& calibration, std::size_t camera);

/// Whether a device is the one that `camera` was calibrated with: same model, same serial (or, where there is
/// none, the same port) and the same picture size. The error says in words what differs. A record with an
/// empty model fits any device.
Status check_device(const Calibration& calibration, std::size_t camera, const DeviceIdentity& found,
                    int width_px, int height_px);

/// Every value within its range, names and tag ids unique, as many records as cameras: what parse_calibration
/// promises of its result and write_calibration demands. `Error::field` is the path of the key.
Status check_calibration(const Calibration& calibration);

/// Reads a file's text. Errors (`file_name` and line in the field): invalid_argument for values and keys,
/// data_corrupt for what is no TOML, unsupported for another version, resource_exhausted for more than
/// max_calibration_bytes.
Result<Calibration> parse_calibration(std::string_view text, const std::string& file_name);
/// The text of a file; reading it again gives the same values, orientations to 1e-15. Errors: as
/// check_calibration.
Result<std::string> format_calibration(const Calibration& calibration);

/// Errors: not_found, io, and those of parse_calibration.
Result<Calibration> load_calibration(const std::filesystem::path& path);
/// Writes beside the file, syncs and renames: whoever reads sees the old or the new file, whole. Errors: io
/// with the system's words, and those of format_calibration.
Status save_calibration(const Calibration& calibration, const std::filesystem::path& path);

}  // namespace handloft::tracking
