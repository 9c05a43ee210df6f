#pragma once
// A folder of pictures as a stream of frames: each camera's in a folder of its name, or beside each other
// with names that begin with the camera's ("left01.jpg", "right01.jpg"). What remains of the name says which
// belong together: they get the same time, a second after the ones before, so that nothing counts as moved.

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "daemon-tracking/source/sample_stream.h"

namespace handloft::tracking {

class ImageFolder final : public SampleStream {
 public:
  /// Errors: not_found when there is no such folder, or no JPEG or PNG of any of these cameras in it. With
  /// one camera, all pictures of the folder are its own when none bears its name.
  static Result<std::unique_ptr<ImageFolder>> open(const std::filesystem::path& folder,
                                                   const std::vector<std::string>& cameras);

  /// Pictures that can't be read are passed over, see problems().
  std::optional<Sample> next() override;
  std::size_t size() const { return files_.size(); }
  /// The file of the frame that next() gave last.
  const std::string& name() const { return name_; }
  const std::vector<std::string>& problems() const { return problems_; }

 private:
  struct File {
    std::filesystem::path path;
    std::uint32_t camera;
    std::string key;
  };
  explicit ImageFolder(std::vector<File> files) : files_(std::move(files)) {}
  std::vector<File> files_;
  std::size_t at_ = 0;
  std::int64_t second_ = 0;
  std::string name_;
  std::vector<std::string> problems_;
};

}  // namespace handloft::tracking
