#pragma once
// What tests in the guest tell programs of the kernel's virtual camera.

#include "daemon-tracking/source/calibration_file.h"

namespace handloft::test {

/// vivid's webcam as the one table camera, in a mode that it has.
inline tracking::Calibration vivid_calibration() {
  using namespace tracking;
  Rig rig = default_rig();
  CameraCalibration camera = rig.cameras.front();
  const double scale = 320.0 / camera.intrinsics.width_px;
  camera.intrinsics.width_px = 320;
  camera.intrinsics.height_px = 180;
  camera.intrinsics.fx_px *= scale;
  camera.intrinsics.fy_px *= scale;
  camera.intrinsics.cx_px = 159.5;
  camera.intrinsics.cy_px = 89.5;
  rig.cameras = {camera};
  Calibration calibration = calibration_of(rig);
  calibration.date = "2026-11-22T12:00:00Z";
  calibration.cameras[0].format = PixelFormat::yuyv;
  calibration.cameras[0].frames_per_s = 30;
  return calibration;
}

}  // namespace handloft::test
