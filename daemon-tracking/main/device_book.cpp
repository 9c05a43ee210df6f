#include "daemon-tracking/main/device_book.h"

#include <fmt/format.h>

#include <utility>

namespace handloft::tracking {

DeviceBook::DeviceBook(Logger log, AlarmOptions options) : log_(std::move(log)), options_(options) {}

bool DeviceBook::note_presence(const std::string& device, bool present, TimePoint time) {
  const bool is_new = !devices_.contains(device);
  Entry& entry = devices_[device];
  entry.report.device = device;
  const bool changed = is_new || entry.report.present != present;
  entry.report.present = present;
  if (changed) {
    entry.slow_for = 0;
    entry.present_since.reset();
    entry.absent_since.reset();
    (present ? entry.present_since : entry.absent_since) = time;
    if (!is_new || present) log_.info("{} {}", device, present ? "is there" : "is gone");
  }
  return changed;
}

bool DeviceBook::note_sample(const std::string& device, TimePoint time, TimePoint arrived,
                             std::uint64_t gap) {
  Entry& entry = devices_[device];
  const bool is_late = entry.absent_since && arrived <= *entry.absent_since;
  const bool changed = !entry.report.present && !is_late && note_presence(device, true, arrived);
  ++entry.report.samples;
  entry.report.last_sample = time;
  entry.own_dropped += gap;
  return changed;
}

void DeviceBook::note_dropped(const std::string& device) {
  ++devices_[device].own_dropped;
}

void DeviceBook::note_refused(const std::string& device) {
  ++devices_[device].own_refused;
}

void DeviceBook::set_facts(const DeviceFacts& facts) {
  Entry& entry = devices_[facts.device];
  entry.report.device = facts.device;
  entry.report.identity = facts.identity;
  entry.report.asked_rate_hz = facts.asked_rate_hz;
  entry.facts_problem = facts.problem;
  entry.facts_dropped = facts.dropped;
  entry.facts_refused = facts.refused;
  if (facts.present) entry.report.present = *facts.present;
}

void DeviceBook::set_placement_problem(const std::string& device, std::string problem) {
  devices_[device].placement_problem = std::move(problem);
}

void DeviceBook::judge(Entry& entry, double elapsed_s, TimePoint now) {
  DeviceReport& report = entry.report;
  report.dropped = entry.own_dropped + entry.facts_dropped;
  report.refused = entry.own_refused + entry.facts_refused;
  const std::uint64_t fresh = report.samples - entry.samples_then;
  const std::uint64_t lost = report.dropped + report.refused - entry.lost_then;
  report.rate_hz = elapsed_s > 0.0 ? static_cast<double>(fresh) / elapsed_s : 0.0;
  entry.samples_then = report.samples;
  entry.lost_then = report.dropped + report.refused;

  // An interval in which it came has not all of its samples.
  const bool whole =
      entry.present_since && elapsed_s > 0.0 && to_seconds(now - *entry.present_since) >= elapsed_s;
  const bool slow = whole && report.present && report.asked_rate_hz > 0.0 &&
                    report.rate_hz < options_.slow_fraction * report.asked_rate_hz;
  entry.slow_for = slow ? entry.slow_for + 1 : 0;
  const bool loses = report.present && report.device == "glove" && lost > 1 &&
                     static_cast<double>(lost) > options_.lost_fraction * static_cast<double>(fresh + lost);
  if (!entry.facts_problem.empty()) {
    report.problem = entry.facts_problem;
  } else if (!entry.placement_problem.empty()) {
    report.problem = entry.placement_problem;
  } else if (entry.slow_for >= options_.slow_intervals) {
    report.problem = fmt::format(
        "slow: {:.1f} frames a second where {:.0f} were asked for; is the exposure too long, the USB bus "
        "full, "
        "or the machine too busy?",
        report.rate_hz, report.asked_rate_hz);
  } else if (loses) {
    report.problem =
        fmt::format("{} of {} reports were lost or unreadable within {:.1f} s; check its cable and hub", lost,
                    fresh + lost, elapsed_s);
  } else {
    report.problem.clear();
  }
}

void DeviceBook::tell(Entry& entry, TimePoint now) {
  const bool wrong = !entry.report.problem.empty();
  if (wrong == entry.alarmed) return;
  if (entry.logged && now - *entry.logged < options_.log_interval) return;  // It will be told later.
  entry.alarmed = wrong;
  entry.logged = now;
  if (wrong) {
    log_.warning("{}: {}", entry.report.device, entry.report.problem);
  } else {
    log_.info("{}: all is well again", entry.report.device);
  }
}

std::vector<DeviceReport> DeviceBook::report(TimePoint now) {
  const double elapsed_s = reported_ ? to_seconds(now - *reported_) : 0.0;
  reported_ = now;
  std::vector<DeviceReport> reports;
  reports.reserve(devices_.size());
  for (auto& [name, entry] : devices_) {
    entry.report.device = name;
    judge(entry, elapsed_s, now);
    tell(entry, now);
    reports.push_back(entry.report);
  }
  return reports;
}

std::vector<DeviceReport> DeviceBook::standing() const {
  std::vector<DeviceReport> reports;
  reports.reserve(devices_.size());
  for (const auto& [name, entry] : devices_) {
    reports.push_back(entry.report);
    reports.back().device = name;
    reports.back().dropped = entry.own_dropped + entry.facts_dropped;
    reports.back().refused = entry.own_refused + entry.facts_refused;
  }
  return reports;
}

}  // namespace handloft::tracking
