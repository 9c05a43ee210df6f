#include "server-model/store/ack_mark.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <utility>

#include "server-model/store/log_schema.h"
#include "server-model/store/side_files.h"

namespace handloft::store {

namespace {

// "HLmark01", branch, sequence, chain, and the first bytes of the hash of all that.
constexpr std::string_view magic = "HLmark01";
constexpr std::size_t number_bytes = 8;
constexpr std::size_t content_bytes = 8 + 2 * number_bytes + model::ContentHash::digest_bytes;
constexpr std::size_t check_bytes = 8;
using Image = std::array<char, content_bytes + check_bytes>;

void seal(Image& image) {
  const auto hash = model::content_hash({image.data(), content_bytes});
  std::copy_n(model::as_bytes(hash).begin(), check_bytes, image.begin() + content_bytes);
}

void put(std::uint64_t number, char* to) {
  for (std::size_t i = 0; i < number_bytes; ++i) to[i] = static_cast<char>((number >> (8 * i)) & 0xffU);
}

std::uint64_t get(const char* from) {
  std::uint64_t number = 0;
  for (std::size_t i = 0; i < number_bytes; ++i)
    number |= static_cast<std::uint64_t>(static_cast<unsigned char>(from[i])) << (8 * i);
  return number;
}

}  // namespace

std::string AckMark::path_of(const std::filesystem::path& log) {
  std::error_code failed;
  const auto followed = std::filesystem::weakly_canonical(log, failed);
  return (failed ? log : followed).string() + mark_suffix;
}

Result<AckMark> AckMark::lock(const std::filesystem::path& log) {
  AckMark mark;
  constexpr mode_t owner_only = 0600;
  const std::string path = path_of(log);
  mark.file_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, owner_only);
  if (mark.file_ < 0) return make_error(ErrorCode::io, fmt::format("{}: {}", path, std::strerror(errno)));
  if (::flock(mark.file_, LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK)
      return make_error(ErrorCode::io, fmt::format("{}: {}", path, std::strerror(errno)));
    return make_error(ErrorCode::failed_precondition,
                      fmt::format("{} is in use by another handloft-modeld", log.string()));
  }
  return mark;
}

std::optional<AckMark::Mark> AckMark::read(const std::filesystem::path& log) {
  const int file = ::open(path_of(log).c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return std::nullopt;
  Image image{};
  const ssize_t got = ::pread(file, image.data(), image.size(), 0);
  ::close(file);
  if (got != static_cast<ssize_t>(image.size())) return std::nullopt;
  Image expected = image;
  seal(expected);
  if (image != expected || std::string_view(image.data(), magic.size()) != magic) return std::nullopt;
  Mark mark;
  mark.sequence = get(image.data() + magic.size() + number_bytes);
  std::memcpy(mark.chain.data(), image.data() + magic.size() + 2 * number_bytes, mark.chain.size());
  return mark;
}

void AckMark::write(const Mark& mark) {
  if (file_ < 0) return;
  Image image{};
  std::copy(magic.begin(), magic.end(), image.begin());
  put(only_line, image.data() + magic.size());
  put(mark.sequence, image.data() + magic.size() + number_bytes);
  std::memcpy(image.data() + magic.size() + 2 * number_bytes, mark.chain.data(), mark.chain.size());
  seal(image);
  // A short or failed write leaves a mark whose hash does not fit: as none.
  [[maybe_unused]] const ssize_t written = ::pwrite(file_, image.data(), image.size(), 0);
}

AckMark::AckMark(AckMark&& other) noexcept : file_(std::exchange(other.file_, -1)) {}

AckMark& AckMark::operator=(AckMark&& other) noexcept {
  std::swap(file_, other.file_);
  return *this;
}

AckMark::~AckMark() {
  if (file_ >= 0) ::close(file_);
}

}  // namespace handloft::store
