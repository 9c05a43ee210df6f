#include "daemon-tracking/calibration/image_folder.h"

#include <fmt/format.h>

#include <algorithm>

#include "daemon-tracking/calibration/picture.h"

namespace handloft::tracking {
namespace {

namespace fs = std::filesystem;

bool is_picture(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension == ".jpg" || extension == ".jpeg" || extension == ".png";
}

std::vector<fs::path> pictures_in(const fs::path& folder) {
  std::vector<fs::path> found;
  std::error_code problem;
  for (fs::directory_iterator at(folder, problem), end; !problem && at != end; at.increment(problem))
    if (at->is_regular_file(problem) && is_picture(at->path())) found.push_back(at->path());
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

Result<std::unique_ptr<ImageFolder>> ImageFolder::open(const fs::path& folder,
                                                       const std::vector<std::string>& cameras) {
  std::error_code problem;
  if (!fs::is_directory(folder, problem))
    return make_error(ErrorCode::not_found, "there is no such folder", folder.string());
  std::vector<File> files;
  const std::vector<fs::path> beside = pictures_in(folder);
  for (std::uint32_t camera = 0; camera < cameras.size(); ++camera) {
    for (const fs::path& path : pictures_in(folder / cameras[camera]))
      files.push_back({path, camera, path.stem().string()});
    for (const fs::path& path : beside)
      if (path.stem().string().starts_with(cameras[camera]))
        files.push_back({path, camera, path.stem().string().substr(cameras[camera].size())});
  }
  if (files.empty() && cameras.size() == 1)
    for (const fs::path& path : beside) files.push_back({path, 0, path.stem().string()});
  if (files.empty())
    return make_error(ErrorCode::not_found,
                      fmt::format("found no pictures of {}: expected {}/*.jpg or {}*.jpg, or PNGs",
                                  fmt::join(cameras, ", "), cameras.empty() ? "CAMERA" : cameras[0],
                                  cameras.empty() ? "CAMERA" : cameras[0]),
                      folder.string());
  std::stable_sort(files.begin(), files.end(), [](const File& a, const File& b) {
    return a.key != b.key ? a.key < b.key : a.camera < b.camera;
  });
  return std::unique_ptr<ImageFolder>(new ImageFolder(std::move(files)));
}

std::optional<Sample> ImageFolder::next() {
  while (at_ < files_.size()) {
    const File& file = files_[at_];
    if (at_ == 0 || file.key != files_[at_ - 1].key) ++second_;
    ++at_;
    name_ = file.path.filename().string();
    Result<CameraFrame> frame = read_picture(file.path);
    if (!frame) {
      problems_.push_back(frame.error().describe());
      continue;
    }
    frame->camera = file.camera;
    frame->sequence = at_;
    frame->capture_time = frame->arrival_time = from_ns(second_ * 1'000'000'000);
    return std::move(*frame);
  }
  return std::nullopt;
}

}  // namespace handloft::tracking
