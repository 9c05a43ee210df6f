// Recording that meets a full disk: the error is named, what was written stays readable (T13, X5).

#include "daemon-tracking/main/sample_recorder.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>

#include "daemon-tracking/source/recorded/recorded_stream.h"
#include "tests/support/test_data.h"

namespace handloft::tracking {
namespace {

const Logger quiet("test", LogLevel::off);

GloveBytes report(std::int64_t number) {
  return {from_ns(number), std::vector<std::uint8_t>(64, static_cast<std::uint8_t>(number))};
}

// This process may not make files larger than `bytes`, for as long as the object lives.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) : old_handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &old_);
    const rlimit limit{bytes, old_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &old_);
    std::signal(SIGXFSZ, old_handler_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit old_{};
  void (*old_handler_)(int);
};

TEST(SampleRecorder, WritesWhatItWasGiven) {
  const test::TemporaryDirectory folder;
  const ManualClock clock;
  auto recorder = SampleRecorder::create(folder.path() / "a.rec", {{"rig", "default"}}, clock, quiet);
  ASSERT_TRUE(recorder.ok()) << recorder.error().describe();
  for (std::int64_t i = 0; i < 100; ++i) (*recorder)->record(report(i));
  ASSERT_TRUE((*recorder)->finish().ok());
  EXPECT_TRUE((*recorder)->finish().ok()) << "twice is as good as once";
  EXPECT_EQ((*recorder)->sample_count(), 100u);
  auto stream = RecordedStream::open(folder.path() / "a.rec");
  ASSERT_TRUE(stream.ok());
  EXPECT_EQ((*stream)->metadata().more.at("rig"), "default");
  std::int64_t count = 0;
  while (const auto sample = (*stream)->next()) EXPECT_EQ(delivery_time(*sample), from_ns(count++));
  EXPECT_EQ(count, 100);
}

TEST(SampleRecorder, AFullDiskIsNamedAndWhatWasWrittenStaysReadable) {
  const test::TemporaryDirectory folder;
  const ManualClock clock;
  auto recorder = SampleRecorder::create(folder.path() / "a.rec", {}, clock, quiet);
  ASSERT_TRUE(recorder.ok());
  Status status;
  {
    const FileSizeLimit limit(64 << 10);
    for (std::int64_t i = 0; i < 2000; ++i) (*recorder)->record(report(i));
    status = (*recorder)->finish();
  }
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, ErrorCode::io);
  EXPECT_NE(status.error().describe().find("a.rec"), std::string::npos) << status.error().describe();
  auto stream = RecordedStream::open(folder.path() / "a.rec");
  ASSERT_TRUE(stream.ok()) << stream.error().describe();
  std::int64_t count = 0;
  while (const auto sample = (*stream)->next()) ASSERT_EQ(delivery_time(*sample), from_ns(count++));
  EXPECT_FALSE((*stream)->error().has_value());
  EXPECT_GT(count, 100);
  EXPECT_LT(count, 2000);
}

TEST(SampleRecorder, NoFolderIsAnErrorAtOnce) {
  const ManualClock clock;
  const auto recorder = SampleRecorder::create("/does/not/exist/a.rec", {}, clock, quiet);
  ASSERT_FALSE(recorder.ok());
  EXPECT_NE(recorder.error().describe().find("/does/not/exist/a.rec"), std::string::npos);
}

}  // namespace
}  // namespace handloft::tracking
