// A serial glove behind a pseudo terminal (T3, T9): the real source on a line that the test speaks at the
// other end.

#include "daemon-tracking/source/glove/serial_glove.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <condition_variable>
#include <mutex>
#include <thread>

namespace handloft::tracking {
namespace {

using namespace std::chrono_literals;

constexpr auto patience = 20s;

class SerialGloveLineTest : public testing::Test {
 protected:
  void SetUp() override { open_terminal(); }
  void TearDown() override {
    if (terminal_ >= 0) ::close(terminal_);
  }
  void open_terminal() {
    terminal_ = ::posix_openpt(O_RDWR | O_NOCTTY);
    ASSERT_GE(terminal_, 0);
    ASSERT_EQ(::grantpt(terminal_), 0);
    ASSERT_EQ(::unlockpt(terminal_), 0);
    path_ = ::ptsname(terminal_);
  }
  PluggedDevice node() const {
    PluggedDevice out;
    out.subsystem = "tty";
    out.devnode = path_;
    out.serial = "LUCID1";
    return out;
  }
  std::unique_ptr<GloveSource> start(const std::string& line) {
    SerialGloveOptions options;
    options.line = line;
    auto glove = make_serial_glove(options, hotplug_, clock_, log_);
    const Status status = glove->start([this](Sample sample) {
      const std::lock_guard lock(mutex_);
      if (const auto* presence = std::get_if<DevicePresence>(&sample)) {
        presences_.push_back(presence->present);
      } else {
        const auto& data = std::get<DeviceBytes>(sample);
        lines_.emplace_back(data.bytes.begin(), data.bytes.end());
      }
      changed_.notify_all();
    });
    EXPECT_TRUE(status.ok());
    return glove;
  }
  void speak(const std::string& text) const {
    EXPECT_EQ(::write(terminal_, text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }
  template <typename Predicate>
  bool wait(const Predicate& predicate) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, patience, predicate);
  }
  // Lines that come before the source listens are thrown away with the line's old bytes: speaks until it is
  // heard.
  bool speak_until_heard() {
    const TimePoint until = clock_.now() + patience;
    while (clock_.now() < until) {
      speak("x\nA1B2\n");
      std::unique_lock lock(mutex_);
      if (changed_.wait_for(lock, 20ms, [&] { return !presences_.empty() && presences_.back(); }))
        return true;
    }
    return false;
  }

  int terminal_ = -1;
  std::string path_;
  SystemClock clock_;
  Logger log_{"test", LogLevel::off};
  ManualHotplug hotplug_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<bool> presences_;
  std::vector<std::string> lines_;
};

TEST_F(SerialGloveLineTest, IsThereOnceItSpeaksAndGoneWhenUnplugged) {
  const auto glove = start(path_);
  EXPECT_NE(glove->status().problem, "");
  hotplug_.plug(node());
  ASSERT_TRUE(speak_until_heard());
  EXPECT_TRUE(glove->status().present);
  EXPECT_EQ(glove->status().problem, "");
  speak("A7B8C9D10E11\nnonsense\nA8\n");
  ASSERT_TRUE(wait([&] { return !lines_.empty() && lines_.back() == "A8"; }));
  EXPECT_EQ(lines_[lines_.size() - 3], "A7B8C9D10E11");
  EXPECT_EQ(lines_[lines_.size() - 2], "nonsense") << "recorded as it came";
  EXPECT_GE(glove->status().refused, 1u);
  hotplug_.unplug("tty", path_);
  ASSERT_TRUE(wait([&] { return !presences_.back(); }));
}

TEST_F(SerialGloveLineTest, ALineThatHangsUpIsGone) {
  const auto glove = start("serial=LUCID1");
  hotplug_.plug(node());
  ASSERT_TRUE(speak_until_heard());
  ::close(terminal_);
  terminal_ = -1;
  ASSERT_TRUE(wait([&] { return !presences_.back(); }));
  EXPECT_FALSE(glove->status().present);
}

TEST_F(SerialGloveLineTest, OnlyTheNamedLineIsOpened) {
  const auto glove = start("/dev/some-other-line");
  hotplug_.plug(node());
  EXPECT_FALSE(glove->status().present);
  EXPECT_EQ(glove->status().identity, "") << "never tried";
  auto nameless = make_serial_glove({}, hotplug_, clock_, log_);
  EXPECT_EQ(nameless->start([](Sample) {}).error().code, ErrorCode::invalid_argument);
}

TEST_F(SerialGloveLineTest, AFileIsNoSerialLine) {
  PluggedDevice device = node();
  device.devnode = "/dev/null";
  const auto glove = start("/dev/null");
  hotplug_.plug(device);
  const TimePoint until = clock_.now() + patience;
  while (glove->status().problem.find("no serial line") == std::string::npos && clock_.now() < until)
    std::this_thread::yield();
  EXPECT_NE(glove->status().problem.find("no serial line"), std::string::npos) << glove->status().problem;
}

}  // namespace
}  // namespace handloft::tracking
