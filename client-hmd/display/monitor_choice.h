#pragma once
// Which monitor a full-screen picture covers while monitors come and go: the asked one when it is there, a
// window on whatever is left when it is unplugged, and the asked one again when it is back.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace handloft::client {

struct MonitorInfo {
  std::string name;
  int x_px = 0;  ///< Of its top left corner, on the desktop.
  int y_px = 0;
  int width_px = 0;
  int height_px = 0;
  int refresh_hz = 0;
  bool operator==(const MonitorInfo&) const = default;
};

/// "0: HDMI-1, 1920x1080 at 60 Hz", a line each.
std::string describe(const std::vector<MonitorInfo>& monitors);

/// By number or by name: the whole name beats a part of it, a part must be one monitor's only. Sizes that no
/// monitor has are passed over.
std::optional<MonitorInfo> find_monitor(const std::vector<MonitorInfo>& monitors, std::string_view wanted);

/// Where the picture is to be.
struct Placement {
  std::optional<MonitorInfo> cover;  ///< None: an ordinary window.
  std::string said;                  ///< For people, why; empty at the start when all is as asked.
  bool operator==(const Placement&) const = default;
};

class MonitorChoice {
 public:
  /// None: always a window.
  explicit MonitorChoice(std::optional<std::string> wanted) : wanted_(std::move(wanted)) {}

  /// At the start and after every change; nullopt: leave the picture where it is.
  std::optional<Placement> after_change(const std::vector<MonitorInfo>& monitors);

 private:
  std::optional<std::string> wanted_;
  std::optional<std::string> found_name_;  ///< Numbers shift when others are unplugged; names stay.
  std::optional<Placement> last_;
};

}  // namespace handloft::client
