#include "daemon-tracking/source/sample_stream.h"

#include <type_traits>

namespace handloft::tracking {

TimePoint delivery_time(const Sample& sample) {
  return std::visit(
      [](const auto& value) {
        using T = std::decay_t<decltype(value)>;
        if constexpr (std::is_same_v<T, CameraFrame> || std::is_same_v<T, GloveBytes> ||
                      std::is_same_v<T, DeviceBytes>) {
          return value.arrival_time;
        } else {
          return value.time;
        }
      },
      sample);
}

void shift_times(Sample& sample, Duration by) {
  if (auto* frame = std::get_if<CameraFrame>(&sample)) {
    frame->capture_time += by;
    frame->arrival_time += by;
  } else if (auto* report = std::get_if<GloveBytes>(&sample)) {
    report->arrival_time += by;
  } else if (auto* data = std::get_if<DeviceBytes>(&sample)) {
    data->arrival_time += by;
  } else if (auto* presence = std::get_if<DevicePresence>(&sample)) {
    presence->time += by;
  } else if (auto* truth = std::get_if<Truth>(&sample)) {
    truth->time += by;
  }
}

MergedStream::MergedStream(std::vector<std::unique_ptr<SampleStream>> streams) {
  for (auto& stream : streams) {
    Head head;
    head.stream = std::move(stream);
    head.sample = head.stream->next();
    heads_.push_back(std::move(head));
  }
}

std::optional<Sample> MergedStream::next() {
  Head* first = nullptr;
  for (Head& head : heads_) {
    if (!head.sample) continue;
    if (first == nullptr || delivery_time(*head.sample) < delivery_time(*first->sample)) first = &head;
  }
  if (first == nullptr) return std::nullopt;
  std::optional<Sample> sample = std::move(first->sample);
  first->sample = first->stream->next();
  return sample;
}

void MergedStream::skip_frames_before(TimePoint time) {
  for (Head& head : heads_) head.stream->skip_frames_before(time);
}

}  // namespace handloft::tracking
