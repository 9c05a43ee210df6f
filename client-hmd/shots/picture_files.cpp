#include "client-hmd/shots/picture_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace handloft::client {
namespace {

constexpr int fewest_digits = 4;

/// For a shell: in quotes, whatever the name holds.
std::string quoted(const std::string& word) {
  std::string out = "'";
  for (const char c : word) {
    if (c == '\'') {
      out += "'\\''";
    } else {
      out += c;
    }
  }
  return out + "'";
}

Error in_the_way(const std::filesystem::path& path) {
  return make_error(ErrorCode::already_exists,
                    fmt::format("{} exists already; choose another folder, or --overwrite", path.string()),
                    "turntable");
}

}  // namespace

PictureFiles::PictureFiles(std::filesystem::path folder, std::size_t count, ExistingFiles existing)
    : folder_(std::move(folder)),
      count_(count),
      digits_(std::max(fewest_digits, static_cast<int>(std::to_string(count).size()))),
      existing_(existing) {}

Result<PictureFiles> PictureFiles::prepare(std::filesystem::path folder, std::size_t count,
                                           ExistingFiles existing) {
  std::error_code failure;
  std::filesystem::create_directories(folder, failure);
  if (failure) {
    return make_error(ErrorCode::io, fmt::format("cannot make {}: {}", folder.string(), failure.message()));
  }
  PictureFiles files(std::move(folder), count, existing);
  for (std::size_t i = 0; existing == ExistingFiles::keep && i < count; ++i) {
    if (std::filesystem::exists(std::filesystem::symlink_status(files.path(i), failure))) {
      return in_the_way(files.path(i));
    }
  }
  return files;
}

std::filesystem::path PictureFiles::path(std::size_t index) const {
  return folder_ / fmt::format("frame-{:0{}}.png", index + 1, digits_);
}

Status PictureFiles::write(std::size_t index, const Image& image) const {
  std::error_code failure;
  if (existing_ == ExistingFiles::keep &&
      std::filesystem::exists(std::filesystem::symlink_status(path(index), failure))) {
    return in_the_way(path(index));
  }
  return write_png(path(index), image);
}

std::string PictureFiles::how_to_make_a_video(double rate_hz) const {
  const std::string pattern = (folder_ / fmt::format("frame-%0{}d.png", digits_)).string();
  return fmt::format(
      "wrote {} pictures to {}; to make a video of them: ffmpeg -framerate {} -i {} -c:v libx264 -crf 18 "
      "-pix_fmt yuv420p -vf 'crop=trunc(iw/2)*2:trunc(ih/2)*2' {}",
      count_, folder_.string(), rate_hz, quoted(pattern),
      quoted((folder_.string().ends_with('/') ? folder_.parent_path() : folder_).string() + ".mp4"));
}

}  // namespace handloft::client
