// T3, T9: what the HID sources do with a device that is absent, foreign, closed to us, silent, broken or
// unplugged; on a HID system of the test's own and without any waiting but for the event.

#include <gtest/gtest.h>

#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

#include "daemon-tracking/source/glove/hid_glove.h"
#include "daemon-tracking/source/hid/hid_reader.h"
#include "daemon-tracking/source/space_mouse/hid_space_mouse.h"

namespace handloft::tracking {
namespace {

using namespace std::chrono_literals;

constexpr auto patience = 20s;

/// One pretended device: what the test does to it, and what was done to it.
class Pretended final : public HidSystem {
 public:
  // The test's side.
  void push(std::vector<std::uint8_t> report) {
    const std::lock_guard lock(mutex_);
    reports_.push_back(std::move(report));
    changed_.notify_all();
  }
  void break_reads() {
    const std::lock_guard lock(mutex_);
    broken_ = true;
    changed_.notify_all();
  }
  void set_open_error(std::optional<Error> error) {
    const std::lock_guard lock(mutex_);
    open_error_ = std::move(error);
  }
  void set_feature_works(bool works) {
    const std::lock_guard lock(mutex_);
    feature_works_ = works;
  }
  template <typename Predicate>
  bool wait(const Predicate& predicate) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, patience, predicate);
  }
  std::vector<std::uint8_t> descriptor{glove_report_descriptor().begin(), glove_report_descriptor().end()};
  // Read in wait().
  int opened = 0, open_now = 0;
  std::string last_opened;
  std::vector<std::uint8_t> written;
  std::array<std::uint8_t, glove_range_size> feature = encode_glove_range({10, 900, 0, 1023, true});

  // The source's side.
  Result<std::vector<std::uint8_t>> report_descriptor(const PluggedDevice& device) override {
    if (device.subsystem == "usb") return std::vector<std::uint8_t>();
    return descriptor;
  }
  Result<std::unique_ptr<HidDevice>> open(const PluggedDevice& device) override {
    const std::lock_guard lock(mutex_);
    ++opened;
    last_opened = device.devnode;
    changed_.notify_all();
    if (open_error_) return *open_error_;
    broken_ = false;
    ++open_now;
    return std::unique_ptr<HidDevice>(new Handle(*this));
  }

 private:
  class Handle final : public HidDevice {
   public:
    explicit Handle(Pretended& all) : all_(all) {}
    ~Handle() override {
      const std::lock_guard lock(all_.mutex_);
      --all_.open_now;
      all_.changed_.notify_all();
    }
    Result<std::size_t> read(std::span<std::uint8_t> into, std::chrono::milliseconds timeout) override {
      std::unique_lock lock(all_.mutex_);
      all_.changed_.wait_for(lock, timeout, [&] { return !all_.reports_.empty() || all_.broken_; });
      if (all_.broken_) return make_error(ErrorCode::io, "reading failed: Input/output error");
      if (all_.reports_.empty()) return std::size_t{0};
      const auto report = std::move(all_.reports_.front());
      all_.reports_.pop_front();
      std::copy_n(report.begin(), std::min(report.size(), into.size()), into.begin());
      return report.size();
    }
    Status write(std::span<const std::uint8_t> report) override {
      const std::lock_guard lock(all_.mutex_);
      all_.written.assign(report.begin(), report.end());
      all_.changed_.notify_all();
      return {};
    }
    Result<std::size_t> get_feature(std::span<std::uint8_t> into) override {
      const std::lock_guard lock(all_.mutex_);
      if (!all_.feature_works_) return make_error(ErrorCode::io, "a stall");
      std::copy_n(all_.feature.begin(), std::min(into.size(), all_.feature.size()), into.begin());
      return std::min(into.size(), all_.feature.size());
    }
    Status set_feature(std::span<const std::uint8_t> report) override {
      const std::lock_guard lock(all_.mutex_);
      std::copy_n(report.begin(), std::min(report.size(), all_.feature.size()), all_.feature.begin());
      return {};
    }

   private:
    Pretended& all_;
  };

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::vector<std::uint8_t>> reports_;
  bool broken_ = false;
  bool feature_works_ = true;
  std::optional<Error> open_error_;
};

PluggedDevice node(const std::string& devnode = "/dev/hidraw3") {
  PluggedDevice out;
  out.subsystem = "hidraw";
  out.devnode = devnode;
  out.vendor_id = glove_usb_vendor;
  out.product_id = glove_usb_product;
  out.serial = "GL7";
  out.name = "Handloft Glove";
  return out;
}

PluggedDevice usb_node() {
  PluggedDevice out = node("/dev/bus/usb/001/004");
  out.subsystem = "usb";
  return out;
}

class HidSources : public testing::Test {
 protected:
  void deliver(Sample sample) {
    const std::lock_guard lock(mutex_);
    if (const auto* presence = std::get_if<DevicePresence>(&sample)) {
      presences_.push_back(presence->present);
    } else {
      samples_.push_back(std::move(sample));
    }
    changed_.notify_all();
  }
  std::unique_ptr<GloveSource> start_glove(HidGloveOptions options = {}) {
    options.wait_for_hidraw = 50ms;
    auto glove = make_hid_glove(options, hotplug_, system_, clock_, log_);
    EXPECT_TRUE(glove->start([this](Sample sample) { deliver(std::move(sample)); }).ok());
    return glove;
  }
  template <typename Predicate>
  bool wait(const Predicate& predicate) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, patience, predicate);
  }
  bool wait_presences(std::vector<bool> expected) {
    return wait([&] { return presences_ == expected; });
  }
  // A problem is written by the source's thread; it has no event of its own.
  bool wait_problem(const GloveSource& glove, const std::string& part) {
    const TimePoint until = clock_.now() + patience;
    while (glove.status().problem.find(part) == std::string::npos) {
      if (clock_.now() > until) return false;
      std::this_thread::yield();
    }
    return true;
  }
  void push(std::uint16_t sequence) {
    GloveReport report;
    report.sequence = sequence;
    const auto bytes = encode_glove_report(report);
    system_->push({bytes.begin(), bytes.end()});
  }

  SystemClock clock_;
  Logger log_{"test", LogLevel::off};
  ManualHotplug hotplug_;
  std::shared_ptr<Pretended> system_ = std::make_shared<Pretended>();
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<bool> presences_;
  std::vector<Sample> samples_;
};

TEST_F(HidSources, AnAbsentGloveIsWaitedForT3) {
  const auto glove = start_glove();
  EXPECT_NE(glove->status().problem.find("plug the glove in"), std::string::npos);
  EXPECT_FALSE(glove->start({}).ok()) << "it is started already";
  hotplug_.plug(node());
  ASSERT_TRUE(wait_presences({true}));
  push(0);
  ASSERT_TRUE(wait([&] { return samples_.size() == 2; }));
  EXPECT_EQ(std::get<GloveBytes>(samples_[0]).bytes[0], glove_range_id) << "its range comes first";
  EXPECT_EQ(std::get<GloveBytes>(samples_[1]).bytes[0], glove_report_id);
  hotplug_.unplug("hidraw", "/dev/hidraw3");
  ASSERT_TRUE(wait_presences({true, false}));
  EXPECT_EQ(glove->status().times_lost, 1u);
  EXPECT_TRUE(wait_problem(*glove, "was unplugged"));
  hotplug_.plug(node("/dev/hidraw4"));
  ASSERT_TRUE(wait_presences({true, false, true}));
  EXPECT_EQ(glove->status().identity, "1209:0001 Handloft Glove, serial GL7 (/dev/hidraw4)");
}

TEST_F(HidSources, ABrokenReadReleasesTheGloveAndOpensItAgain) {
  const auto glove = start_glove();
  hotplug_.plug(node());
  ASSERT_TRUE(wait_presences({true}));
  system_->break_reads();
  ASSERT_TRUE(wait([&] { return presences_.size() >= 3; }));
  EXPECT_EQ(presences_, (std::vector<bool>{true, false, true}));
  push(0);
  ASSERT_TRUE(wait([&] { return !samples_.empty() && std::get<GloveBytes>(samples_.back()).bytes[0] == 1; }));
}

TEST_F(HidSources, AGloveThatMayNotBeOpenedSaysWhatToDo) {
  system_->set_open_error(
      make_error(ErrorCode::permission_denied, "/dev/hidraw3 may not be opened: install the rules"));
  const auto glove = start_glove();
  hotplug_.plug(node());
  ASSERT_TRUE(wait_problem(*glove, "install the rules"));
  EXPECT_FALSE(glove->status().present);
  system_->set_open_error(std::nullopt);  // udev gives access a little later.
  ASSERT_TRUE(wait_presences({true}));
}

TEST_F(HidSources, AForeignDeviceIsLeftAloneUntilPluggedInAnew) {
  const std::vector<std::uint8_t> mine = system_->descriptor;
  system_->descriptor = {0x05, 0x01, 0x09, 0x06, 0xA1, 0x01, 0xC0};
  const auto glove = start_glove();
  hotplug_.plug(node());
  ASSERT_TRUE(wait_problem(*glove, "no glove of ours"));
  EXPECT_NE(glove->status().problem.find("0001:0006"), std::string::npos) << glove->status().problem;
  hotplug_.unplug("hidraw", "/dev/hidraw3");
  system_->descriptor = mine;
  hotplug_.plug(node());
  ASSERT_TRUE(wait_presences({true}));
  EXPECT_TRUE(system_->wait([&] { return system_->opened == 2; })) << "the foreign one was opened once";
}

TEST_F(HidSources, ASilentGloveIsSaidToBeSoAndOpenedAnew) {
  HidGloveOptions options;
  options.silent_after = 60ms;
  const auto glove = start_glove(options);
  hotplug_.plug(node());
  ASSERT_TRUE(wait([&] { return presences_.size() >= 2; }));
  EXPECT_FALSE(presences_[1]);
  EXPECT_TRUE(wait_problem(*glove, "sends nothing"));
  EXPECT_TRUE(system_->wait([&] { return system_->opened >= 2; }));
}

TEST_F(HidSources, ReportsThatAreMissingOrCorruptAreCounted) {
  const auto glove = start_glove();
  hotplug_.plug(node());
  ASSERT_TRUE(wait_presences({true}));
  push(65534);
  push(65535);
  push(3);
  system_->push({1, 2, 3});
  push(4);
  ASSERT_TRUE(wait([&] { return samples_.size() == 6; })) << "with its range; bad ones are recorded too";
  const TimePoint until = clock_.now() + patience;
  while (glove->status().samples < 5 && clock_.now() < until) std::this_thread::yield();
  EXPECT_EQ(glove->status().lost, 3u);
  EXPECT_EQ(glove->status().refused, 1u);
}

TEST_F(HidSources, LightAndVibrationReachTheGlove) {
  const auto glove = start_glove();
  glove->show({9, 9, 9, 0, 0});  // Nobody is there: forgotten.
  hotplug_.plug(node());
  ASSERT_TRUE(wait_presences({true}));
  const auto expected = encode_glove_output({1, 2, 3, 4, 500});
  glove->show({1, 2, 3, 4, 500});
  EXPECT_TRUE(system_->wait([&] {
    return std::equal(system_->written.begin(), system_->written.end(), expected.begin(), expected.end());
  }));
}

TEST_F(HidSources, TheRangeIsKeptInTheGloveAndReadBack) {
  const auto glove = start_glove();
  EXPECT_EQ(glove->range().error().code, ErrorCode::not_found);
  hotplug_.plug(node());
  ASSERT_TRUE(wait_presences({true}));
  const GloveRange range{50, 700, 20, 1000, true};
  ASSERT_TRUE(glove->set_range(range).ok());
  EXPECT_EQ(*glove->range(), range);
  EXPECT_FALSE(glove->set_range({700, 50, 0, 1023, true}).ok());
  ASSERT_TRUE(wait([&] { return samples_.size() == 2; })) << "the new range is a sample, too";
  EXPECT_EQ(parse_glove_range(std::get<GloveBytes>(samples_[1]).bytes)->force_full, 700);
}

TEST_F(HidSources, AUsbGloveWithoutHidrawIsOpenedThroughLibusbOnlyThen) {
  const auto glove = start_glove();
  hotplug_.plug(usb_node());
  hotplug_.plug(node());
  ASSERT_TRUE(wait_presences({true}));
  EXPECT_TRUE(system_->wait([&] { return system_->last_opened == "/dev/hidraw3"; }));
  hotplug_.unplug("hidraw", "/dev/hidraw3");
  ASSERT_TRUE(wait_presences({true, false, true})) << "the node went, the USB device stayed";
  EXPECT_TRUE(system_->wait([&] { return system_->last_opened == "/dev/bus/usb/001/004"; }));
}

TEST_F(HidSources, AUsbDeviceThatDoesNotAnswerAsAGloveIsNone) {
  system_->set_feature_works(false);
  const auto glove = start_glove();
  hotplug_.plug(usb_node());
  ASSERT_TRUE(wait_problem(*glove, "no glove of ours"));
}

TEST_F(HidSources, OfTwoGlovesTheOneThatIsMeantIsOpened) {
  HidGloveOptions options;
  options.serial = "OTHER";
  const auto glove = start_glove(options);
  hotplug_.plug(node());
  PluggedDevice meant = node("/dev/hidraw9");
  meant.serial = "OTHER";
  hotplug_.plug(meant);
  ASSERT_TRUE(wait_presences({true}));
  EXPECT_TRUE(system_->wait([&] { return system_->last_opened == "/dev/hidraw9" && system_->opened == 1; }));
}

TEST_F(HidSources, StopEndsInTheMiddleOfEverything) {
  for (int i = 0; i < 20; ++i) {
    const auto glove = start_glove();
    hotplug_.plug(node());
    push(static_cast<std::uint16_t>(i));
    glove->stop();
    glove->stop();
    hotplug_.unplug("hidraw", "/dev/hidraw3");
  }
  EXPECT_TRUE(system_->wait([&] { return system_->open_now == 0; }));
}

TEST_F(HidSources, A3dMouseIsKnownByItsDescriptorOrItsNumbers) {
  system_->descriptor = {0x05, 0x01, 0x09, 0x08, 0xA1, 0x01, 0x85, 0x01, 0x75,
                         0x10, 0x95, 0x06, 0x09, 0x30, 0x81, 0x02, 0xC0};
  const auto mouse = make_hid_space_mouse({}, hotplug_, system_, clock_, log_);
  ASSERT_TRUE(mouse->start([this](Sample sample) { deliver(std::move(sample)); }).ok());
  PluggedDevice device = node();
  device.vendor_id = 0x1111;  // Unknown, but a multi-axis controller.
  hotplug_.plug(device);
  ASSERT_TRUE(wait_presences({true}));
  system_->push({1, 5, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
  ASSERT_TRUE(wait([&] { return samples_.size() == 1; }));
  EXPECT_EQ(std::get<DeviceBytes>(samples_[0]).kind, DeviceData::space_mouse_report);
  hotplug_.unplug("hidraw", "/dev/hidraw3");
  ASSERT_TRUE(wait_presences({true, false}));
}

TEST(ManualHotplug, TellsWhatIsThereThenWhatChanges) {
  ManualHotplug hotplug;
  hotplug.plug(node());
  std::vector<std::string> told;
  const auto tell = [&](PlugChange change, const PluggedDevice& device) {
    told.push_back((change == PlugChange::added ? "+" : "-") + device.devnode);
  };
  auto all = hotplug.subscribe("", tell);
  auto hidraw = hotplug.subscribe("hidraw", [](PlugChange, const PluggedDevice&) {});
  hotplug.plug(node());  // Nothing new.
  PluggedDevice other = node();
  other.serial = "X";
  hotplug.plug(other);  // Another device under the same name.
  hotplug.unplug("hidraw", "/dev/nothing");
  hotplug.unplug("hidraw", "/dev/hidraw3");
  EXPECT_EQ(told,
            (std::vector<std::string>{"+/dev/hidraw3", "-/dev/hidraw3", "+/dev/hidraw3", "-/dev/hidraw3"}));
  all.reset();
  hotplug.plug(node());
  EXPECT_EQ(told.size(), 4u);
  EXPECT_EQ(hotplug.present("hidraw").size(), 1u);
  EXPECT_EQ(hotplug.present("input").size(), 0u);
}

}  // namespace
}  // namespace handloft::tracking
