#include "daemon-tracking/main/sample_recorder.h"

#include <utility>

#include "common/base/version.h"
#include "daemon-tracking/source/recorded/recorded_stream.h"

namespace handloft::tracking {

namespace {

// Some seconds of three cameras and a glove, below 100 MiB.
constexpr std::size_t waiting_samples = 2048;

}  // namespace

Result<std::unique_ptr<SampleRecorder>> SampleRecorder::create(
    const std::filesystem::path& path, const std::map<std::string, std::string>& description,
    const Clock& clock, Logger log) {
  record::Metadata metadata;
  metadata.program = program_version("handloft-trackd");
  metadata.started_at = record::wall_clock_now();
  metadata.started_at_ns = to_ns(clock.now());
  metadata.more = description;
  Result<record::RecordingWriter> writer = record::RecordingWriter::create(path, metadata, clock);
  if (!writer) return writer.error();
  return std::unique_ptr<SampleRecorder>(new SampleRecorder(std::move(*writer), std::move(log)));
}

SampleRecorder::SampleRecorder(record::RecordingWriter writer, Logger log)
    : writer_(std::move(writer)), log_(std::move(log)), queue_(waiting_samples), thread_([this] { run(); }) {}

SampleRecorder::~SampleRecorder() {
  (void)finish();
}

void SampleRecorder::record(Sample sample) {
  if (overflowed_.load() || queue_.push(std::move(sample))) return;
  overflowed_.store(true);
  log_.error("the disk is too slow for the recording: it ends here, after {} samples", written_.load());
}

void SampleRecorder::run() {
  while (std::optional<Sample> sample = queue_.pop()) {
    if (!status_) continue;
    status_ = append_sample(writer_, *sample);
    if (status_) {
      ++written_;
    } else {
      log_.error("recording ends: {}", status_.error().describe());
    }
  }
}

Status SampleRecorder::finish() {
  queue_.close();
  if (thread_.joinable()) {
    thread_.join();
    if (status_) status_ = writer_.finish();
    if (status_ && overflowed_.load()) {
      status_ = make_error(ErrorCode::resource_exhausted, "the disk was too slow; the recording is cut short",
                           "record");
    }
  }
  return status_;
}

}  // namespace handloft::tracking
