#pragma once
// Samples out of a recording (T13; common/record/recording.h), in the order in which they were written: the
// same that the live pipeline saw. Records of other types (what the daemon published) are passed over.

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "common/base/result.h"
#include "common/record/recording.h"
#include "daemon-tracking/source/sample_stream.h"

namespace handloft::tracking {

/// The type of records that hold one encoded sample (sample_codec.h).
inline constexpr std::uint16_t sample_record_type = 1;

/// Appends a sample, stamped with its delivery time.
Status append_sample(record::RecordingWriter& writer, const Sample& sample);

/// Which samples a stream hands on.
struct RecordedSelection {
  enum class Kind { all, camera, glove, pen, space_mouse };
  Kind kind = Kind::all;
  std::uint32_t camera = 0;  ///< Kind::camera: CameraFrame::camera.
  std::string device;        ///< Kind::camera: whose DevicePresence, "camera/left".

  bool wants(const Sample& sample) const;
};

class RecordedStream final : public SampleStream {
 public:
  static Result<std::unique_ptr<RecordedStream>> open(const std::filesystem::path& path,
                                                      RecordedSelection selection = {});
  RecordedStream(record::RecordingReader reader, RecordedSelection selection);

  std::optional<Sample> next() override;
  const record::Metadata& metadata() const { return reader_.metadata(); }
  /// After next() gave nullopt: why it ended before the recording's end; nullopt when all was read.
  const std::optional<Error>& error() const { return error_; }
  /// After next() gave nullopt without an error: whether the file ended in the middle of a record.
  record::RecordingEnd end() const { return reader_.end(); }

 private:
  record::RecordingReader reader_;
  RecordedSelection selection_;
  std::optional<Error> error_;
  bool ended_ = false;
};

/// The shift that brings a recording's first sample to `start`; for PaceOptions::shift. Reads the file's
/// first sample.
Result<Duration> shift_to(const std::filesystem::path& path, TimePoint start);

}  // namespace handloft::tracking
