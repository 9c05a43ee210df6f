#pragma once
// What is known of every device: whether it is there, how fast it delivers, what is wrong with it (T12, T14).
// Counts come from the samples themselves, so that a replay says the same of them; what only the device's own
// driver knows (identity, drifted exposure) comes as DeviceFacts. Alarms are words: the first that applies of
//
//   what the device's own source says (no permission, wrong mode, exposure drifted)
//   the camera was moved (camera_watch.h)
//   fewer frames than asked for, for two seconds running
//   reports of the glove were lost or unreadable within the last interval
//
// Not thread-safe.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/log.h"
#include "daemon-tracking/publish/tracking_message.h"

namespace handloft::tracking {

/// What a source knows of its device beside the samples.
struct DeviceFacts {
  std::string device;    ///< "camera/left", as in DevicePresence.
  std::string identity;  ///< Model, serial number, port: for people.
  double asked_rate_hz = 0.0;
  std::string problem;        ///< In words; empty: all is well.
  std::uint64_t refused = 0;  ///< Since the start: frames that were no picture, reports of a wrong size.
  std::uint64_t dropped = 0;  ///< Since the start, as far as no gap in the samples' own counter shows it.
  std::optional<bool> present = std::nullopt;  ///< Of a device that delivers no samples; else they say so.
};

struct AlarmOptions {
  double slow_fraction = 0.9;  ///< Below this share of the asked rate a camera is slow...
  int slow_intervals = 2;      ///< ...when it is so for so many intervals of about a second.
  double lost_fraction =
      0.01;  ///< Share of a glove's reports that may be lost: a busy hub loses single ones.
  Duration log_interval = std::chrono::seconds(10);  ///< The log hears of one device no more often.
};

class DeviceBook {
 public:
  explicit DeviceBook(Logger log, AlarmOptions options = {});

  /// True: it was not so before.
  bool note_presence(const std::string& device, bool present, TimePoint time);
  /// A sample of `time` came at `arrived`, and with it the knowledge that `gap` before it did not. True: the
  /// device was not present. What arrived before the device went, but was looked at after, does not bring it
  /// back.
  bool note_sample(const std::string& device, TimePoint time, TimePoint arrived, std::uint64_t gap = 0);
  void note_dropped(const std::string& device);
  void note_refused(const std::string& device);
  /// Facts replace what was said of that device before.
  void set_facts(const DeviceFacts& facts);
  /// What another stage found wrong; empty: nothing.
  void set_placement_problem(const std::string& device, std::string problem);

  /// Closes the interval since the last call and judges it; at most about once a second makes sense.
  std::vector<DeviceReport> report(TimePoint now);
  /// As it stands, without closing the interval.
  std::vector<DeviceReport> standing() const;

 private:
  struct Entry {
    DeviceReport report;
    std::string facts_problem;
    std::string placement_problem;
    std::uint64_t own_dropped = 0, own_refused = 0;      // Counted here.
    std::uint64_t facts_dropped = 0, facts_refused = 0;  // Counted by the source.
    std::uint64_t samples_then = 0, lost_then = 0;       // At the last report.
    int slow_for = 0;
    std::optional<TimePoint> present_since, absent_since;
    std::optional<TimePoint> logged;
    bool alarmed = false;
  };

  void judge(Entry& entry, double elapsed_s, TimePoint now);
  void tell(Entry& entry, TimePoint now);

  Logger log_;
  AlarmOptions options_;
  std::map<std::string, Entry> devices_;
  std::optional<TimePoint> reported_;
};

}  // namespace handloft::tracking
