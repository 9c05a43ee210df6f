#pragma once
// The files of a sequence (V8): frame-0001.png and on in a folder of its own. Nothing that exists is
// overwritten unless that is wished, every file appears whole or not at all, and a full disk is told with the
// file that did not fit.

#include <cstddef>
#include <filesystem>

#include "client-hmd/render/image.h"
#include "common/base/result.h"

namespace handloft::client {

enum class ExistingFiles { keep, overwrite };

class PictureFiles {
 public:
  /// Makes the folder where there is none. Errors: already_exists, naming the first file of the sequence that
  /// stands in the way; io.
  static Result<PictureFiles> prepare(std::filesystem::path folder, std::size_t count,
                                      ExistingFiles existing);

  std::filesystem::path path(std::size_t index) const;
  /// Picture `index`, from 0. Errors: io; already_exists for a file that came meanwhile.
  Status write(std::size_t index, const Image& image) const;

  /// How to make a video of them, in words and as a command.
  std::string how_to_make_a_video(double rate_hz) const;

 private:
  PictureFiles(std::filesystem::path folder, std::size_t count, ExistingFiles existing);
  std::filesystem::path folder_;
  std::size_t count_;
  int digits_;
  ExistingFiles existing_;
};

}  // namespace handloft::client
