#include "daemon-tracking/source/hid/hid_reader.h"

#include <fmt/format.h>

#include <algorithm>

namespace handloft::tracking {

namespace {

// How long a read waits: bounds how late a command or the end is noticed when a device is silent.
constexpr std::chrono::milliseconds read_wait{20};
constexpr std::chrono::seconds command_wait{1};
constexpr const char* hidraw_subsystem = "hidraw";
constexpr const char* usb_subsystem = "usb";

// Waits are real time, whatever clock stamps the samples.
TimePoint waiting_now() {
  return SystemClock().now();
}

}  // namespace

HidReader::HidReader(HidReaderOptions options, HidReaderHooks hooks, HotplugMonitor& hotplug,
                     std::shared_ptr<HidSystem> system, const Clock& clock, Logger log)
    : options_(std::move(options)),
      hooks_(std::move(hooks)),
      hotplug_(hotplug),
      system_(std::move(system)),
      clock_(clock),
      log_(std::move(log)) {}

HidReader::~HidReader() {
  stop();
}

Status HidReader::start() {
  if (started()) return make_error(ErrorCode::failed_precondition, "is reading already", options_.what);
  {
    const std::lock_guard lock(mutex_);
    stopping_ = false;
    status_.problem = fmt::format("not plugged in: plug the {} in", options_.what);
  }
  const auto on_change = [this](PlugChange change, const PluggedDevice& device) { on_plug(change, device); };
  hidraw_ = hotplug_.subscribe(hidraw_subsystem, on_change);
  usb_ = hotplug_.subscribe(usb_subsystem, on_change);
  thread_ = std::thread([this] { run(); });
  return {};
}

void HidReader::stop() {
  hidraw_.reset();
  usb_.reset();
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
  run_commands(nullptr);
}

void HidReader::on_plug(PlugChange change, const PluggedDevice& device) {
  const Key key{device.subsystem, device.devnode};
  if (change == PlugChange::removed) {
    const std::lock_guard lock(mutex_);
    // A read may have failed before udev's word came; then this is the reason.
    if (nodes_.erase(key) > 0 && !open_) status_.problem = unplugged();
    changed_.notify_all();
    return;
  }
  Node node;
  node.device = device;
  node.seen = waiting_now();
  if (const auto bytes = system_->report_descriptor(device); bytes && !bytes->empty()) {
    if (auto reports = parse_report_descriptor(*bytes)) node.reports = std::move(*reports);
  }
  if (!hooks_.suits(device, node.reports ? &*node.reports : nullptr)) return;
  const std::lock_guard lock(mutex_);
  nodes_.insert_or_assign(key, std::move(node));
  changed_.notify_all();
}

std::string HidReader::unplugged() const {
  return fmt::format("was unplugged: plug the {} in", options_.what);
}

bool HidReader::plugged(const Key& key) const {
  return nodes_.contains(key);
}

bool HidReader::is_plugged(const Key& key) const {
  const std::lock_guard lock(mutex_);
  return plugged(key);
}

// With the mutex held: the node to open now; else `wait` is when to look again.
std::optional<HidReader::Key> HidReader::choose(TimePoint now, Duration& wait) {
  const auto has_hidraw = [this](const PluggedDevice& device) {
    return std::any_of(nodes_.begin(), nodes_.end(), [&](const auto& each) {
      const PluggedDevice& other = each.second.device;
      return other.subsystem == hidraw_subsystem && other.vendor_id == device.vendor_id &&
             other.product_id == device.product_id;
    });
  };
  for (const auto& [key, node] : nodes_) {  // "hidraw" comes before "usb".
    if (node.foreign) continue;
    TimePoint due = node.not_before;
    if (node.device.subsystem == usb_subsystem) {
      if (has_hidraw(node.device)) continue;
      due = std::max(due, node.seen + options_.wait_for_hidraw);
    }
    if (due <= now) return key;
    wait = std::min(wait, due - now);
  }
  return std::nullopt;
}

void HidReader::run() {
  while (true) {
    std::optional<Key> key;
    {
      std::unique_lock lock(mutex_);
      Duration wait = std::chrono::hours(1);
      if (stopping_) return;
      key = choose(waiting_now(), wait);
      if (!key && commands_.empty()) {
        changed_.wait_for(lock, wait);
        if (stopping_) return;
      }
    }
    if (key) {
      use(*key);
    } else {
      run_commands(nullptr);
    }
  }
}

void HidReader::use(const Key& key) {
  Node node;
  {
    const std::lock_guard lock(mutex_);
    const auto found = nodes_.find(key);
    if (found == nodes_.end()) return;
    node = found->second;
    status_.identity = describe(node.device);
  }
  auto device = system_->open(node.device);
  if (!device) return fail(key, device.error());
  const HidReports* reports = node.reports ? &*node.reports : nullptr;
  if (Status status = hooks_.accept(**device, node.device, reports); !status) {
    const bool broke = status.error().code == ErrorCode::io || status.error().code == ErrorCode::not_found;
    if (broke) return fail(key, status.error());
    {
      const std::lock_guard lock(mutex_);
      if (const auto found = nodes_.find(key); found != nodes_.end()) found->second.foreign = true;
    }
    return set_problem(fmt::format("{} is no {} of ours: {}", describe(node.device), options_.what,
                                   status.error().describe()));
  }
  log_.info("{} is here: {}", options_.what, describe(node.device));
  {
    const std::lock_guard lock(mutex_);
    status_.present = true;
    status_.problem.clear();
    open_ = true;
  }
  hooks_.on_presence(clock_.now(), true);
  read_on(**device, key);
  {
    const std::lock_guard lock(mutex_);
    status_.present = false;
    open_ = false;
  }
  hooks_.on_presence(clock_.now(), false);
  run_commands(nullptr);
}

void HidReader::read_on(HidDevice& device, const Key& key) {
  std::vector<std::uint8_t> report(options_.max_report);
  TimePoint last = waiting_now();
  bool any = false;
  while (true) {
    const Result<std::size_t> size = device.read(report, read_wait);
    const TimePoint arrival = clock_.now();
    if (!size) return fail(key, size.error());
    if (*size > 0) {
      const bool good = hooks_.on_report(arrival, std::span(report).first(std::min(*size, report.size())));
      last = waiting_now();
      const std::lock_guard lock(mutex_);
      if (!any && good) {
        // Only a report that could be read shows that all is well again.
        any = true;
        if (const auto found = nodes_.find(key); found != nodes_.end()) found->second.back_off = {};
        status_.problem.clear();
      }
      ++status_.samples;
      if (!good) ++status_.refused;
      status_.last_sample = arrival;
    } else if (options_.silence == SilentDevice::suspicious && waiting_now() - last > options_.silent_after) {
      return fail(key,
                  make_error(ErrorCode::timeout,
                             fmt::format("it is open but sends nothing; it is opened anew. If this stays "
                                         "so, plug the {} out and in again",
                                         options_.what)));
    }
    run_commands(&device);
    const std::lock_guard lock(mutex_);
    if (stopping_) return;
    if (!plugged(key)) {
      ++status_.times_lost;
      status_.problem = unplugged();
      log_.info("{} was unplugged", options_.what);
      return;
    }
  }
}

void HidReader::fail(const Key& key, const Error& error) {
  const bool in_use = [&] {
    const std::lock_guard lock(mutex_);
    if (open_) ++status_.times_lost;
    if (const auto found = nodes_.find(key); found != nodes_.end()) {
      Node& node = found->second;
      node.back_off = error.code == ErrorCode::permission_denied || error.code == ErrorCode::unsupported
                          ? options_.last_back_off
                          : std::clamp(node.back_off * 2, options_.first_back_off, options_.last_back_off);
      node.not_before = waiting_now() + node.back_off;
    }
    return open_;
  }();
  if (in_use && !is_plugged(key)) return set_problem(unplugged());
  set_problem(in_use ? fmt::format("the {} broke off: {}", options_.what, error.message) : error.message);
}

void HidReader::set_problem(std::string problem) {
  if (const auto kept_back = problem_limit_.allow(waiting_now()))
    log_.warning("{}: {}", options_.what, problem);
  const std::lock_guard lock(mutex_);
  status_.problem = std::move(problem);
}

void HidReader::run_commands(HidDevice* device) {
  std::deque<Command> commands;
  {
    const std::lock_guard lock(mutex_);
    commands.swap(commands_);
  }
  for (const Command& command : commands) {
    const Status status =
        device == nullptr
            ? Status(make_error(ErrorCode::not_found, fmt::format("the {} isn't there", options_.what)))
            : command.action(*device);
    if (command.done) {
      command.done->set_value(status);
    } else if (!status && device != nullptr) {
      if (problem_limit_.allow(waiting_now())) log_.warning("{}: {}", options_.what, status.error().message);
    }
  }
}

Status HidReader::with_device(std::function<Status(HidDevice&)> action) {
  auto done = std::make_shared<std::promise<Status>>();
  std::future<Status> result = done->get_future();
  {
    const std::lock_guard lock(mutex_);
    if (!open_ || stopping_)
      return make_error(ErrorCode::not_found, fmt::format("the {} isn't there", options_.what));
    commands_.push_back({0, std::move(action), std::move(done)});
  }
  changed_.notify_all();
  if (result.wait_for(command_wait) != std::future_status::ready)
    return make_error(ErrorCode::timeout, fmt::format("the {} does not answer", options_.what));
  return result.get();
}

void HidReader::post(int key, std::function<Status(HidDevice&)> action) {
  const std::lock_guard lock(mutex_);
  if (!open_ || stopping_) return;
  const auto same = std::find_if(commands_.begin(), commands_.end(),
                                 [&](const Command& each) { return !each.done && each.key == key; });
  if (same != commands_.end()) {
    same->action = std::move(action);
  } else {
    commands_.push_back({key, std::move(action), nullptr});
  }
}

DeviceStatus HidReader::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

void HidReader::note_lost(std::uint64_t count) {
  const std::lock_guard lock(mutex_);
  status_.lost += count;
}

}  // namespace handloft::tracking
