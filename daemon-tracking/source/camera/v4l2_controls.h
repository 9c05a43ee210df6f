#pragma once
// A camera's settings held still (T1, tracking.md 5.4): automatic exposure, gain, white balance and focus
// off, so that colours, blur and frame rate stay as they were learned; all read back after they are set, and
// looked at again every second, because cameras forget them and other programs change them.

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "daemon-tracking/source/camera/v4l2_system.h"

namespace handloft::tracking {

/// The mains' frequency, for the camera's own flicker filter.
enum class PowerLine : std::uint8_t { off = 0, hz50 = 1, hz60 = 2 };

/// What is locked, so that colours and exposure stay as they were learned. A value that is left out is locked
/// at what the camera has when it is opened. Numbers are the driver's units where no unit is given.
struct CameraSettings {
  /// At a hand's 444 mm/s (99 of 100 of its speeds), 5 ms are 2.2 mm of blur.
  std::optional<Duration> exposure = std::chrono::milliseconds(5);
  std::optional<int> gain;
  std::optional<int> white_balance_kelvin;
  std::optional<int> focus;
  PowerLine power_line = PowerLine::off;  ///< A fixed exposure needs none, and some cameras bend it to fit.
};

enum class ExposureState : std::uint8_t {
  unknown,    ///< Not opened yet, or the camera has no such setting.
  locked,     ///< Manual, and as asked at the last check.
  drifted,    ///< Something changed it since; it is being set again.
  automatic,  ///< The camera knows no manual exposure, or doesn't keep it.
};

/// What one look at the settings found.
struct ControlReport {
  ExposureState exposure = ExposureState::unknown;
  Duration exposure_time{};          ///< As read back; 0: the camera doesn't tell.
  std::vector<std::string> drifted;  ///< "gain was 20, is set to 10 again"
  std::string problem;               ///< What could not be locked, in words; empty when all is as asked.
};

/// Owns what each control is to be, also over unplugging: what was locked "as it is" when the camera was
/// first opened is what it gets when it comes back. Used by the camera's thread alone.
class ControlKeeper {
 public:
  explicit ControlKeeper(CameraSettings settings) : settings_(settings) {}

  /// Sets everything on a newly started camera and reads it back.
  ControlReport apply(V4l2System& system, int fd);

  /// Reads everything again; what differs is set again. A control that never keeps its value is told as a
  /// problem and set again at every tenth look only.
  ControlReport check(V4l2System& system, int fd);

 private:
  struct Held {
    std::uint32_t id = 0;
    std::string name;
    std::int32_t value = 0;  ///< As read back after it was set.
    int lost = 0;            ///< How many looks running found another value.
  };
  void hold(V4l2System& system, int fd, std::uint32_t id, const char* name,
            std::optional<std::int32_t> wanted);
  void finish(V4l2System& system, int fd, ControlReport& report) const;

  CameraSettings settings_;
  std::vector<Held> held_;
  std::map<std::uint32_t, std::int32_t> remembered_;  ///< Values locked as they were found.
  std::vector<std::string> refused_;
};

}  // namespace handloft::tracking
