// A recording several times over: time goes on, devices are unplugged in between.

#include "daemon-tracking/main/repeated_stream.h"

#include <gtest/gtest.h>

#include <deque>

namespace handloft::tracking {
namespace {

using namespace std::chrono_literals;

class ListStream final : public SampleStream {
 public:
  explicit ListStream(std::deque<Sample> samples) : samples_(std::move(samples)) {}
  std::optional<Sample> next() override {
    if (samples_.empty()) return std::nullopt;
    Sample sample = std::move(samples_.front());
    samples_.pop_front();
    return sample;
  }

 private:
  std::deque<Sample> samples_;
};

std::unique_ptr<SampleStream> one_round() {
  return std::make_unique<ListStream>(std::deque<Sample>{DevicePresence{from_ns(1'000), "glove", true},
                                                         GloveBytes{from_ns(2'000), {1}},
                                                         GloveBytes{from_ns(3'000), {2}}});
}

std::vector<Sample> all_of(RepeatedStream& stream) {
  std::vector<Sample> samples;
  while (std::optional<Sample> sample = stream.next()) samples.push_back(std::move(*sample));
  return samples;
}

TEST(RepeatedStream, TimeGoesOnAndDevicesAreUnpluggedInBetween) {
  RepeatedStream stream(one_round, 3);
  const std::vector<Sample> samples = all_of(stream);
  ASSERT_EQ(samples.size(), 3u + 1u + 3u + 1u + 3u);
  TimePoint last = from_ns(0);
  for (const Sample& sample : samples) {
    EXPECT_GE(delivery_time(sample), last);
    last = delivery_time(sample);
  }
  const auto* gone = std::get_if<DevicePresence>(&samples[3]);
  ASSERT_NE(gone, nullptr);
  EXPECT_EQ(gone->device, "glove");
  EXPECT_FALSE(gone->present);
  EXPECT_EQ(delivery_time(samples[4]) - delivery_time(samples[2]), 100ms);
  EXPECT_EQ(delivery_time(samples[6]) - delivery_time(samples[4]), Duration(2'000))
      << "as in the first round";
  EXPECT_FALSE(stream.next().has_value()) << "for good";
}

TEST(RepeatedStream, OneRoundIsTheRecordingItself) {
  RepeatedStream stream(one_round, 1);
  const std::vector<Sample> samples = all_of(stream);
  ASSERT_EQ(samples.size(), 3u);
  EXPECT_EQ(delivery_time(samples[0]), from_ns(1'000));
}

TEST(RepeatedStream, EndsWhereARoundCannotBeOpened) {
  int opened = 0;
  RepeatedStream stream([&] { return ++opened < 3 ? one_round() : nullptr; }, 100);
  EXPECT_EQ(all_of(stream).size(), 3u + 1u + 3u + 1u);
}

TEST(RepeatedStream, EmptyRoundsEnd) {
  RepeatedStream stream([] { return std::make_unique<ListStream>(std::deque<Sample>{}); }, 1000);
  EXPECT_TRUE(all_of(stream).empty());
}

}  // namespace
}  // namespace handloft::tracking
