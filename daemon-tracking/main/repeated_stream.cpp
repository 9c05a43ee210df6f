#include "daemon-tracking/main/repeated_stream.h"

#include <utility>

namespace handloft::tracking {

namespace {
// From one round's last sample to the next one's first.
constexpr Duration pause_between_rounds = std::chrono::milliseconds(100);
}  // namespace

RepeatedStream::RepeatedStream(std::function<std::unique_ptr<SampleStream>()> reopen, std::uint64_t rounds)
    : reopen_(std::move(reopen)), rounds_left_(rounds) {}

std::optional<Sample> RepeatedStream::next() {
  for (;;) {
    if (round_ == nullptr) {
      if (!present_.empty() && last_) {
        const std::string device = *present_.begin();
        present_.erase(present_.begin());
        if (rounds_left_ > 0) return DevicePresence{*last_, device, false};
        continue;
      }
      if (rounds_left_ == 0) return std::nullopt;
      --rounds_left_;
      round_ = reopen_();
      first_of_round_ = true;
      if (round_ == nullptr) {
        rounds_left_ = 0;
        return std::nullopt;
      }
    }
    std::optional<Sample> sample = round_->next();
    if (!sample) {
      round_.reset();
      continue;
    }
    if (first_of_round_) {
      first_of_round_ = false;
      if (last_) shift_ = *last_ + pause_between_rounds - delivery_time(*sample);
    }
    shift_times(*sample, shift_);
    last_ = delivery_time(*sample);
    if (const auto* presence = std::get_if<DevicePresence>(&*sample)) {
      if (presence->present) {
        present_.insert(presence->device);
      } else {
        present_.erase(presence->device);
      }
    }
    return sample;
  }
}

}  // namespace handloft::tracking
