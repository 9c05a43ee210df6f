#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <ctime>
#include <nlohmann/json.hpp>

#include "common/record/crc32c.h"
#include "common/record/recording.h"
#include "common/record/recording_format.h"

namespace handloft::record {

std::string wall_clock_now() {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  std::tm utc{};
  gmtime_r(&now.tv_sec, &utc);
  return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}.{:03}Z", utc.tm_year + 1900, utc.tm_mon + 1,
                     utc.tm_mday, utc.tm_hour, utc.tm_min, utc.tm_sec, now.tv_nsec / 1'000'000);
}

struct RecordingWriter::Implementation {
  std::string path;
  int fd = -1;
  const Clock* clock = nullptr;
  WriterOptions options;
  std::vector<std::uint8_t> buffer;
  TimePoint last_flush;
  std::uint64_t count = 0;
  std::optional<Error> broken;

  ~Implementation() {
    if (fd >= 0) ::close(fd);
  }

  Status failed(std::string_view what) {
    broken = make_error(ErrorCode::io, fmt::format("{}: {}", what, std::strerror(errno)), path);
    return *broken;
  }

  Status flush() {
    if (broken) return *broken;
    std::size_t done = 0;
    while (done < buffer.size()) {
      const ssize_t count_written = ::write(fd, buffer.data() + done, buffer.size() - done);
      if (count_written < 0) {
        if (errno == EINTR) continue;
        return failed("cannot write the recording");
      }
      done += static_cast<std::size_t>(count_written);
    }
    buffer.clear();
    last_flush = clock->now();
    return {};
  }
};

RecordingWriter::RecordingWriter(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
RecordingWriter::RecordingWriter(RecordingWriter&&) noexcept = default;
RecordingWriter& RecordingWriter::operator=(RecordingWriter&& other) noexcept {
  if (this != &other) {
    if (implementation_) static_cast<void>(finish());
    implementation_ = std::move(other.implementation_);
  }
  return *this;
}
RecordingWriter::~RecordingWriter() {
  if (implementation_) static_cast<void>(finish());
}

Result<RecordingWriter> RecordingWriter::create(const std::filesystem::path& path, const Metadata& metadata,
                                                const Clock& clock, WriterOptions options) {
  std::string text;
  try {
    text = nlohmann::json{{"program", metadata.program},
                          {"started_at", metadata.started_at},
                          {"started_at_ns", metadata.started_at_ns},
                          {"more", metadata.more}}
               .dump();
  } catch (const nlohmann::json::exception& error) {  // text that is not UTF-8
    return make_error(ErrorCode::invalid_argument, error.what(), "metadata");
  }
  if (text.size() > max_metadata_bytes) {
    return make_error(ErrorCode::resource_exhausted,
                      fmt::format("{} bytes, at most {} are allowed", text.size(), max_metadata_bytes),
                      "metadata");
  }
  auto writer = std::make_unique<Implementation>();
  writer->path = path.string();
  writer->clock = &clock;
  writer->options = options;
  writer->last_flush = clock.now();
  writer->fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (writer->fd < 0) return writer->failed("cannot create the recording").error();

  std::vector<std::uint8_t>& out = writer->buffer;
  out.reserve(options.buffer_bytes);
  const std::span<const std::uint8_t> json(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  std::array<std::uint8_t, 4> word{};
  out.insert(out.end(), recording_magic.begin(), recording_magic.end());
  store_little(word.data(), static_cast<std::uint32_t>(text.size()));
  out.insert(out.end(), word.begin(), word.end());
  out.insert(out.end(), json.begin(), json.end());
  store_little(word.data(), crc32c(json));
  out.insert(out.end(), word.begin(), word.end());
  if (const Status status = writer->flush(); !status) return status.error();
  return RecordingWriter(std::move(writer));
}

Status RecordingWriter::append(std::uint16_t type, TimePoint time, std::span<const std::uint8_t> payload) {
  Implementation& writer = *implementation_;
  if (writer.broken) return *writer.broken;
  if (payload.size() > max_record_bytes) {
    return make_error(
        ErrorCode::resource_exhausted,
        fmt::format("a record of {} bytes, at most {} are allowed", payload.size(), max_record_bytes),
        writer.path);
  }
  std::array<std::uint8_t, record_header_bytes> header{};
  store_little(header.data(), static_cast<std::uint32_t>(payload.size()));
  store_little(header.data() + 4, type);
  store_little(header.data() + 8, to_ns(time));
  store_little(header.data() + payload_crc_offset, crc32c(payload));
  store_little(header.data() + header_crc_offset, crc32c(std::span(header).first(header_crc_offset)));
  writer.buffer.insert(writer.buffer.end(), header.begin(), header.end());
  writer.buffer.insert(writer.buffer.end(), payload.begin(), payload.end());
  ++writer.count;
  const bool due = writer.clock->now() - writer.last_flush >= writer.options.flush_interval;
  if (due || writer.buffer.size() >= writer.options.buffer_bytes) return writer.flush();
  return {};
}

Status RecordingWriter::flush() {
  return implementation_->flush();
}

Status RecordingWriter::finish() {
  Implementation& writer = *implementation_;
  if (writer.fd < 0) return writer.broken ? Status(*writer.broken) : Status();
  Status status = writer.flush();
  if (status && ::fdatasync(writer.fd) != 0 && errno != EINVAL) {  // EINVAL: a pipe, which has no disk
    status = writer.failed("cannot bring the recording to the disk");
  }
  if (::close(std::exchange(writer.fd, -1)) != 0 && status)
    status = writer.failed("cannot close the recording");
  if (!writer.broken) {
    writer.broken = make_error(ErrorCode::failed_precondition, "the recording is finished", writer.path);
  }
  return status;
}

std::uint64_t RecordingWriter::record_count() const {
  return implementation_->count;
}

}  // namespace handloft::record
