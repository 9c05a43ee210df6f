#include "daemon-tracking/source/recorded/recorded_stream.h"

#include "daemon-tracking/source/sample_codec.h"

namespace handloft::tracking {

Status append_sample(record::RecordingWriter& writer, const Sample& sample) {
  const Result<std::vector<std::uint8_t>> bytes = encode_sample(sample);
  if (!bytes) return bytes.error();
  return writer.append(sample_record_type, delivery_time(sample), *bytes);
}

bool RecordedSelection::wants(const Sample& sample) const {
  const auto* presence = std::get_if<DevicePresence>(&sample);
  const auto is = [&sample](DeviceData data) {
    const auto* bytes = std::get_if<DeviceBytes>(&sample);
    return bytes != nullptr && bytes->kind == data;
  };
  switch (kind) {
    case Kind::all:
      return true;
    case Kind::camera:
      if (const auto* frame = std::get_if<CameraFrame>(&sample)) return frame->camera == camera;
      return presence != nullptr && presence->device == device;
    case Kind::glove:
      return std::holds_alternative<GloveBytes>(sample) || is(DeviceData::serial_glove_line) ||
             (presence != nullptr && presence->device == "glove");
    case Kind::pen:
      return is(DeviceData::pen_facts) || is(DeviceData::pen_events) ||
             (presence != nullptr && presence->device == "pen");
    case Kind::space_mouse:
      return is(DeviceData::space_mouse_report) || (presence != nullptr && presence->device == "space_mouse");
  }
  return false;
}

Result<std::unique_ptr<RecordedStream>> RecordedStream::open(const std::filesystem::path& path,
                                                             RecordedSelection selection) {
  Result<record::RecordingReader> reader = record::RecordingReader::open(path);
  if (!reader) return reader.error();
  return std::make_unique<RecordedStream>(std::move(*reader), std::move(selection));
}

RecordedStream::RecordedStream(record::RecordingReader reader, RecordedSelection selection)
    : reader_(std::move(reader)), selection_(std::move(selection)) {}

std::optional<Sample> RecordedStream::next() {
  while (!ended_) {
    const Result<std::optional<record::Record>> record = reader_.next();
    if (!record) {
      error_ = record.error();
      ended_ = true;
    } else if (!record->has_value()) {
      ended_ = true;
    } else if ((*record)->type == sample_record_type) {
      Result<Sample> sample = decode_sample((*record)->payload);
      if (!sample) {
        error_ = sample.error();
        ended_ = true;
      } else if (selection_.wants(*sample)) {
        return std::move(*sample);
      }
    }
  }
  return std::nullopt;
}

Result<Duration> shift_to(const std::filesystem::path& path, TimePoint start) {
  Result<std::unique_ptr<RecordedStream>> stream = RecordedStream::open(path);
  if (!stream) return stream.error();
  const std::optional<Sample> first = (*stream)->next();
  if (!first) {
    return make_error(ErrorCode::data_corrupt, "found no samples, expected at least one", path.string());
  }
  return start - delivery_time(*first);
}

}  // namespace handloft::tracking
