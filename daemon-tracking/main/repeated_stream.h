#pragma once
// A recording played several times over: for endurance. Between two rounds every device is unplugged, since
// their own counters begin anew with the next.

#include <functional>
#include <memory>
#include <set>
#include <string>

#include "daemon-tracking/source/sample_stream.h"

namespace handloft::tracking {

class RepeatedStream final : public SampleStream {
 public:
  /// `reopen` gives each round's stream; null ends it all. `rounds` >= 1.
  RepeatedStream(std::function<std::unique_ptr<SampleStream>()> reopen, std::uint64_t rounds);
  std::optional<Sample> next() override;

 private:
  std::function<std::unique_ptr<SampleStream>()> reopen_;
  std::uint64_t rounds_left_;
  std::unique_ptr<SampleStream> round_;
  bool first_of_round_ = true;
  Duration shift_{};
  std::optional<TimePoint> last_;  // Delivery time of the newest sample given out.
  std::set<std::string> present_;  // Devices plugged in.
};

}  // namespace handloft::tracking
