#include <fmt/format.h>

#include <cerrno>
#include <nlohmann/json.hpp>

#include "common/record/crc32c.h"
#include "common/record/recording.h"
#include "common/record/recording_format.h"

namespace handloft::record {

namespace {

/// A record's bytes are read in pieces of this size, so that a damaged length costs no more than what is
/// there.
constexpr std::size_t piece_bytes = 1u << 20;

}  // namespace

struct RecordingReader::Implementation {
  std::string name;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file{nullptr, &std::fclose};
  std::span<const std::uint8_t> memory;  // when there is no file
  std::uint64_t offset = 0;
  Metadata metadata;
  std::vector<std::uint8_t> payload;
  RecordingEnd end = RecordingEnd::complete;
  bool at_end = false;
  std::optional<Error> broken;

  /// How many of `count` bytes were there.
  std::size_t read(std::uint8_t* out, std::size_t count) {
    if (file) return std::fread(out, 1, count, file.get());
    const std::size_t there = std::min(count, memory.size());
    std::copy_n(memory.begin(), there, out);
    memory = memory.subspan(there);
    return there;
  }

  /// `count` bytes into `payload`, whose size tells how many there were.
  void read_payload(std::size_t count) {
    payload.clear();
    while (payload.size() < count) {
      const std::size_t begin = payload.size();
      const std::size_t piece = std::min(count - begin, piece_bytes);
      payload.resize(begin + piece);
      const std::size_t there = read(payload.data() + begin, piece);
      payload.resize(begin + there);
      if (there < piece) return;
    }
  }

  Error corrupt(const std::string& problem) {
    return make_error(ErrorCode::data_corrupt, fmt::format("at byte {}: {}", offset, problem), name);
  }

  Status read_head() {
    std::array<std::uint8_t, 8> magic{};
    const std::size_t there = read(magic.data(), magic.size());
    std::array<std::uint8_t, 8> expected = recording_magic;
    expected[magic_version_byte] = magic[magic_version_byte];
    if (there < magic.size() || magic != expected) return corrupt("this is not a Handloft recording");
    if (magic[magic_version_byte] != recording_magic[magic_version_byte]) {
      return make_error(ErrorCode::unsupported,
                        fmt::format("recording version {}, this program reads version {}",
                                    magic[magic_version_byte], recording_magic[magic_version_byte]),
                        name);
    }
    std::array<std::uint8_t, 4> word{};
    if (read(word.data(), word.size()) < word.size()) return corrupt("the head is cut off");
    const auto size = load_little<std::uint32_t>(word.data());
    if (size > max_metadata_bytes) {
      return corrupt(fmt::format("metadata of {} bytes, at most {} are allowed", size, max_metadata_bytes));
    }
    read_payload(size);
    if (payload.size() < size || read(word.data(), word.size()) < word.size()) {
      return corrupt("the head is cut off");
    }
    if (crc32c(payload) != load_little<std::uint32_t>(word.data())) {
      return corrupt("the metadata's checksum is wrong");
    }
    offset = recording_magic.size() + 2 * word.size() + size;
    return read_metadata();
  }

  Status read_metadata() {
    try {
      const nlohmann::json json = nlohmann::json::parse(payload.begin(), payload.end());
      metadata.program = json.at("program").get<std::string>();
      metadata.started_at = json.at("started_at").get<std::string>();
      metadata.started_at_ns = json.at("started_at_ns").get<std::int64_t>();
      metadata.more = json.at("more").get<std::map<std::string, std::string>>();
      return {};
    } catch (const nlohmann::json::exception& error) {
      return make_error(ErrorCode::data_corrupt, fmt::format("the metadata: {}", error.what()), name);
    }
  }

  Result<std::optional<Record>> finish(RecordingEnd how) {
    at_end = true;
    end = how;
    return std::optional<Record>();
  }

  Result<std::optional<Record>> damaged(const std::string& problem) {
    broken = corrupt(problem);
    return *broken;
  }

  Result<std::optional<Record>> next() {
    if (broken) return *broken;
    if (at_end) return std::optional<Record>();
    std::array<std::uint8_t, record_header_bytes> header{};
    const std::size_t there = read(header.data(), header.size());
    if (there == 0) return finish(RecordingEnd::complete);
    if (there < header.size()) return finish(RecordingEnd::truncated);
    if (crc32c(std::span(header).first(header_crc_offset)) !=
        load_little<std::uint32_t>(header.data() + header_crc_offset)) {
      return damaged("the checksum of the record's head is wrong");
    }
    const auto size = load_little<std::uint32_t>(header.data());
    if (size > max_record_bytes) {
      return damaged(fmt::format("a record of {} bytes, at most {} are allowed", size, max_record_bytes));
    }
    read_payload(size);
    if (payload.size() < size) return finish(RecordingEnd::truncated);
    if (crc32c(payload) != load_little<std::uint32_t>(header.data() + payload_crc_offset)) {
      return damaged("the record's checksum is wrong");
    }
    offset += header.size() + size;
    Record record;
    record.type = load_little<std::uint16_t>(header.data() + 4);
    record.time = from_ns(load_little<std::int64_t>(header.data() + 8));
    record.payload = payload;
    return std::optional(record);
  }
};

RecordingReader::RecordingReader(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
RecordingReader::RecordingReader(RecordingReader&&) noexcept = default;
RecordingReader& RecordingReader::operator=(RecordingReader&&) noexcept = default;
RecordingReader::~RecordingReader() = default;

Result<RecordingReader> RecordingReader::open(const std::filesystem::path& path) {
  auto reader = std::make_unique<Implementation>();
  reader->name = path.string();
  reader->file.reset(std::fopen(path.c_str(), "rbe"));
  if (!reader->file) {
    const ErrorCode code = errno == ENOENT ? ErrorCode::not_found : ErrorCode::io;
    return make_error(code, fmt::format("cannot open the recording: {}", std::strerror(errno)), reader->name);
  }
  if (const Status status = reader->read_head(); !status) return status.error();
  return RecordingReader(std::move(reader));
}

Result<RecordingReader> RecordingReader::from_bytes(std::span<const std::uint8_t> bytes, std::string name) {
  auto reader = std::make_unique<Implementation>();
  reader->name = std::move(name);
  reader->memory = bytes;
  if (const Status status = reader->read_head(); !status) return status.error();
  return RecordingReader(std::move(reader));
}

const Metadata& RecordingReader::metadata() const {
  return implementation_->metadata;
}
Result<std::optional<Record>> RecordingReader::next() {
  return implementation_->next();
}
RecordingEnd RecordingReader::end() const {
  return implementation_->end;
}
std::uint64_t RecordingReader::offset() const {
  return implementation_->offset;
}

}  // namespace handloft::record
