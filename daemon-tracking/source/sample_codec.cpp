#include "daemon-tracking/source/sample_codec.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <string_view>

#include "daemon-tracking/source/glove_report.h"

namespace handloft::tracking {
namespace {

enum Kind : std::uint8_t {
  kind_frame = 1,
  kind_glove = 2,
  kind_presence = 3,
  kind_truth = 4,
  kind_device = 5
};

class Writer {
 public:
  template <typename T>
  void number(T value) {
    const auto bits = static_cast<std::uint64_t>(value);
    for (std::size_t i = 0; i < sizeof(T); ++i) bytes_.push_back(static_cast<std::uint8_t>(bits >> (8 * i)));
  }
  void real(double value) { number(std::bit_cast<std::uint64_t>(value)); }
  template <typename Range>
  void append(const Range& range) {
    bytes_.insert(bytes_.end(), range.begin(), range.end());
  }
  std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  std::vector<std::uint8_t> bytes_;
};

/// Reads fields in order; after the first that is missing all are zero and `missing()` names it.
class Reader {
 public:
  explicit Reader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  template <typename T>
  T number(const char* field) {
    const auto from = take(sizeof(T), field);
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < from.size(); ++i) bits |= static_cast<std::uint64_t>(from[i]) << (8 * i);
    return static_cast<T>(bits);
  }
  double real(const char* field) { return std::bit_cast<double>(number<std::uint64_t>(field)); }
  std::span<const std::uint8_t> take(std::size_t size, const char* field) {
    if (missing_ == nullptr && size > bytes_.size()) missing_ = field;
    if (missing_ != nullptr) return {};
    const auto taken = bytes_.first(size);
    bytes_ = bytes_.subspan(size);
    return taken;
  }
  /// data_corrupt when a field was missing or bytes are left over.
  Status complete() const {
    if (missing_ != nullptr)
      return make_error(ErrorCode::data_corrupt, "the bytes end before it does", missing_);
    if (!bytes_.empty()) {
      return make_error(ErrorCode::data_corrupt, fmt::format("found {} bytes after the end", bytes_.size()),
                        "length");
    }
    return {};
  }

 private:
  std::span<const std::uint8_t> bytes_;
  const char* missing_ = nullptr;
};

Error not_a_flag(const char* field, unsigned found) {
  return make_error(ErrorCode::invalid_argument, fmt::format("found {}, expected 0 or 1", found), field);
}

Status check_frame(const CameraFrame& frame, std::size_t size) {
  if (size > max_frame_bytes) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found {} bytes, expected at most {}", size, max_frame_bytes), "bytes");
  }
  const auto check_edge = [](int value, const char* field) -> Status {
    if (value >= 1 && value <= static_cast<int>(max_frame_edge_px)) return {};
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected 1..{}", value, max_frame_edge_px), field);
  };
  if (Status status = check_edge(frame.width_px, "width_px"); !status) return status;
  if (Status status = check_edge(frame.height_px, "height_px"); !status) return status;
  const auto format = static_cast<unsigned>(frame.format);
  if (format < 1 || format > 3) {
    return make_error(ErrorCode::unsupported, fmt::format("found {}, expected 1..3", format), "format");
  }
  return {};
}

Status check_truth(const Truth& truth) {
  bool finite = std::isfinite(truth.pressure);
  for (const auto& tip : truth.fingertips_m) {
    for (const double value : tip) finite = finite && std::isfinite(value);
  }
  for (const double value : truth.head_position_m) finite = finite && std::isfinite(value);
  for (const double value : truth.head_orientation_wxyz) finite = finite && std::isfinite(value);
  if (!finite) return make_error(ErrorCode::invalid_argument, "found a value that is not finite", "truth");
  return {};
}

Result<std::vector<std::uint8_t>> encode(const CameraFrame& frame) {
  const std::size_t size = frame.bytes ? frame.bytes->size() : 0;
  if (Status status = check_frame(frame, size); !status) return status.error();
  Writer writer;
  writer.number(std::uint8_t{kind_frame});
  writer.number(frame.camera);
  writer.number(frame.sequence);
  writer.number(to_ns(frame.capture_time));
  writer.number(to_ns(frame.arrival_time));
  writer.number(static_cast<std::uint8_t>(frame.format));
  writer.number(static_cast<std::uint16_t>(frame.width_px));
  writer.number(static_cast<std::uint16_t>(frame.height_px));
  writer.number(static_cast<std::uint32_t>(size));
  if (frame.bytes) writer.append(*frame.bytes);
  return writer.take();
}

Result<std::vector<std::uint8_t>> encode(const GloveBytes& report) {
  if (report.bytes.size() > glove_report_size) {
    return make_error(
        ErrorCode::resource_exhausted,
        fmt::format("found {} bytes, expected at most {}", report.bytes.size(), glove_report_size), "bytes");
  }
  Writer writer;
  writer.number(std::uint8_t{kind_glove});
  writer.number(to_ns(report.arrival_time));
  writer.number(static_cast<std::uint8_t>(report.bytes.size()));
  writer.append(report.bytes);
  return writer.take();
}

Result<std::vector<std::uint8_t>> encode(const DevicePresence& presence) {
  if (presence.device.size() > max_device_name) {
    return make_error(
        ErrorCode::resource_exhausted,
        fmt::format("found {} bytes, expected at most {}", presence.device.size(), max_device_name),
        "device");
  }
  Writer writer;
  writer.number(std::uint8_t{kind_presence});
  writer.number(to_ns(presence.time));
  writer.number(static_cast<std::uint8_t>(presence.present));
  writer.number(static_cast<std::uint8_t>(presence.device.size()));
  writer.append(presence.device);
  return writer.take();
}

Result<std::vector<std::uint8_t>> encode(const Truth& truth) {
  if (Status status = check_truth(truth); !status) return status.error();
  Writer writer;
  writer.number(std::uint8_t{kind_truth});
  writer.number(to_ns(truth.time));
  writer.number(static_cast<std::uint8_t>(truth.hand_present));
  for (const auto& tip : truth.fingertips_m) {
    for (const double value : tip) writer.real(value);
  }
  for (const double value : truth.head_position_m) writer.real(value);
  for (const double value : truth.head_orientation_wxyz) writer.real(value);
  writer.real(truth.pressure);
  return writer.take();
}

Status check_device(unsigned kind, std::size_t size) {
  constexpr auto last = static_cast<unsigned>(DeviceData::serial_glove_line);
  if (kind < 1 || kind > last) {
    return make_error(ErrorCode::unsupported, fmt::format("found {}, expected 1..{}", kind, last), "data");
  }
  if (size > max_device_bytes) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("found {} bytes, expected at most {}", size, max_device_bytes), "bytes");
  }
  return {};
}

Result<std::vector<std::uint8_t>> encode(const DeviceBytes& data) {
  if (Status status = check_device(static_cast<unsigned>(data.kind), data.bytes.size()); !status)
    return status.error();
  Writer writer;
  writer.number(std::uint8_t{kind_device});
  writer.number(to_ns(data.arrival_time));
  writer.number(static_cast<std::uint8_t>(data.kind));
  writer.number(static_cast<std::uint16_t>(data.bytes.size()));
  writer.append(data.bytes);
  return writer.take();
}

Result<Sample> decode_device(Reader& reader) {
  DeviceBytes data;
  data.arrival_time = from_ns(reader.number<std::int64_t>("arrival_time"));
  const auto kind = reader.number<std::uint8_t>("data");
  const auto size = reader.number<std::uint16_t>("length");
  const auto bytes = reader.take(size, "bytes");
  if (Status status = reader.complete(); !status) return status.error();
  if (Status status = check_device(kind, bytes.size()); !status) return status.error();
  data.kind = static_cast<DeviceData>(kind);
  data.bytes.assign(bytes.begin(), bytes.end());
  return Sample(std::move(data));
}

Result<Sample> decode_frame(Reader& reader) {
  CameraFrame frame;
  frame.camera = reader.number<std::uint32_t>("camera");
  frame.sequence = reader.number<std::uint64_t>("sequence");
  frame.capture_time = from_ns(reader.number<std::int64_t>("capture_time"));
  frame.arrival_time = from_ns(reader.number<std::int64_t>("arrival_time"));
  frame.format = static_cast<PixelFormat>(reader.number<std::uint8_t>("format"));
  frame.width_px = reader.number<std::uint16_t>("width_px");
  frame.height_px = reader.number<std::uint16_t>("height_px");
  const auto size = reader.number<std::uint32_t>("length");
  // take() refuses a length beyond what is there, so nothing is allocated on the file's word alone.
  const auto bytes = reader.take(size, "bytes");
  if (Status status = reader.complete(); !status) return status.error();
  if (Status status = check_frame(frame, bytes.size()); !status) return status.error();
  frame.bytes = std::make_shared<const std::vector<std::uint8_t>>(bytes.begin(), bytes.end());
  return Sample(std::move(frame));
}

Result<Sample> decode_glove(Reader& reader) {
  GloveBytes report;
  report.arrival_time = from_ns(reader.number<std::int64_t>("arrival_time"));
  const auto size = reader.number<std::uint8_t>("length");
  const auto bytes = reader.take(size, "bytes");
  if (Status status = reader.complete(); !status) return status.error();
  if (size > glove_report_size) {
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {}, expected at most {}", size, glove_report_size), "length");
  }
  report.bytes.assign(bytes.begin(), bytes.end());
  return Sample(std::move(report));
}

Result<Sample> decode_presence(Reader& reader) {
  DevicePresence presence;
  presence.time = from_ns(reader.number<std::int64_t>("time"));
  const auto present = reader.number<std::uint8_t>("present");
  const auto size = reader.number<std::uint8_t>("length");
  const auto name = reader.take(size, "device");
  if (Status status = reader.complete(); !status) return status.error();
  if (present > 1) return not_a_flag("present", present);
  presence.present = present == 1;
  presence.device.assign(name.begin(), name.end());
  return Sample(std::move(presence));
}

Result<Sample> decode_truth(Reader& reader) {
  Truth truth;
  truth.time = from_ns(reader.number<std::int64_t>("time"));
  const auto present = reader.number<std::uint8_t>("hand_present");
  for (auto& tip : truth.fingertips_m) {
    for (double& value : tip) value = reader.real("fingertips_m");
  }
  for (double& value : truth.head_position_m) value = reader.real("head_position_m");
  for (double& value : truth.head_orientation_wxyz) value = reader.real("head_orientation_wxyz");
  truth.pressure = reader.real("pressure");
  if (Status status = reader.complete(); !status) return status.error();
  if (present > 1) return not_a_flag("hand_present", present);
  truth.hand_present = present == 1;
  if (Status status = check_truth(truth); !status) return status.error();
  return Sample(truth);
}

}  // namespace

Result<std::vector<std::uint8_t>> encode_sample(const Sample& sample) {
  return std::visit([](const auto& value) { return encode(value); }, sample);
}

Result<Sample> decode_sample(std::span<const std::uint8_t> bytes) {
  Reader reader(bytes);
  const auto kind = reader.number<std::uint8_t>("kind");
  switch (kind) {
    case kind_frame:
      return decode_frame(reader);
    case kind_glove:
      return decode_glove(reader);
    case kind_presence:
      return decode_presence(reader);
    case kind_truth:
      return decode_truth(reader);
    case kind_device:
      return decode_device(reader);
    default:
      break;
  }
  if (bytes.empty()) return make_error(ErrorCode::data_corrupt, "found no bytes", "kind");
  return make_error(ErrorCode::unsupported, fmt::format("found {}, expected 1..5", kind), "kind");
}

}  // namespace handloft::tracking
