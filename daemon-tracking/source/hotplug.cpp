#include "daemon-tracking/source/hotplug.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

namespace handloft::tracking {

std::string describe(const PluggedDevice& device) {
  std::string text = fmt::format("{:04x}:{:04x}", device.vendor_id, device.product_id);
  if (!device.name.empty()) text += " " + device.name;
  if (!device.serial.empty()) text += ", serial " + device.serial;
  if (!device.path_id.empty()) text += ", at " + device.path_id;
  return text + " (" + device.devnode + ")";
}

// Shared with the subscriptions, which may outlive the monitor. The mutex is held during callbacks, so that
// none runs after its subscription has ended.
struct HotplugMonitor::Registry {
  using Key = std::pair<std::string, std::string>;  // devnode, subsystem
  struct Subscriber {
    std::string subsystem;
    HotplugCallback callback;
  };

  std::mutex mutex;
  std::map<Key, PluggedDevice> devices;
  std::map<std::uint64_t, Subscriber> subscribers;
  std::uint64_t next_id = 1;

  void tell(PlugChange change, const PluggedDevice& device) const {
    for (const auto& [id, subscriber] : subscribers) {
      if (subscriber.subsystem.empty() || subscriber.subsystem == device.subsystem)
        subscriber.callback(change, device);
    }
  }
  void remove(std::map<Key, PluggedDevice>::iterator known) {
    const PluggedDevice gone = std::move(known->second);
    devices.erase(known);
    tell(PlugChange::removed, gone);
  }
  void add(PluggedDevice device) {
    Key key{device.devnode, device.subsystem};
    const auto known = devices.find(key);
    if (known != devices.end()) {
      if (known->second == device) return;
      remove(known);
    }
    const auto& added = devices.emplace(std::move(key), std::move(device)).first->second;
    tell(PlugChange::added, added);
  }
};

HotplugMonitor::HotplugMonitor() : registry_(std::make_shared<Registry>()) {}
HotplugMonitor::~HotplugMonitor() = default;

std::unique_ptr<HotplugMonitor::Subscription> HotplugMonitor::subscribe(std::string subsystem,
                                                                        HotplugCallback callback) {
  const std::lock_guard lock(registry_->mutex);
  const std::uint64_t id = registry_->next_id++;
  for (const auto& [key, device] : registry_->devices) {
    if (subsystem.empty() || subsystem == device.subsystem) callback(PlugChange::added, device);
  }
  registry_->subscribers.emplace(id, Registry::Subscriber{std::move(subsystem), std::move(callback)});
  return std::unique_ptr<Subscription>(new Subscription(registry_, id));
}

std::vector<PluggedDevice> HotplugMonitor::present(std::string_view subsystem) const {
  const std::lock_guard lock(registry_->mutex);
  std::vector<PluggedDevice> out;
  for (const auto& [key, device] : registry_->devices) {
    if (subsystem.empty() || subsystem == device.subsystem) out.push_back(device);
  }
  return out;
}

void HotplugMonitor::note_added(PluggedDevice device) {
  const std::lock_guard lock(registry_->mutex);
  registry_->add(std::move(device));
}

void HotplugMonitor::note_removed(std::string_view subsystem, std::string_view devnode) {
  const std::lock_guard lock(registry_->mutex);
  const auto known = registry_->devices.find({std::string(devnode), std::string(subsystem)});
  if (known != registry_->devices.end()) registry_->remove(known);
}

void HotplugMonitor::note_all(const std::vector<std::string>& subsystems, std::vector<PluggedDevice> found) {
  const std::lock_guard lock(registry_->mutex);
  const auto is_found = [&](const PluggedDevice& device) {
    return std::any_of(found.begin(), found.end(), [&](const PluggedDevice& each) {
      return each.devnode == device.devnode && each.subsystem == device.subsystem;
    });
  };
  std::vector<Registry::Key> missing;
  for (const auto& [key, device] : registry_->devices) {
    if (std::find(subsystems.begin(), subsystems.end(), device.subsystem) == subsystems.end()) continue;
    if (!is_found(device)) missing.push_back(key);
  }
  for (const Registry::Key& key : missing) registry_->remove(registry_->devices.find(key));
  for (PluggedDevice& device : found) registry_->add(std::move(device));
}

HotplugMonitor::Subscription::Subscription(std::shared_ptr<Registry> registry, std::uint64_t id)
    : registry_(std::move(registry)), id_(id) {}

HotplugMonitor::Subscription::~Subscription() {
  const std::lock_guard lock(registry_->mutex);
  registry_->subscribers.erase(id_);
}

}  // namespace handloft::tracking
