#pragma once
// When pictures are taken and where they are kept (V8): the one that the options ask for, and one for every
// press of the key.

#include <functional>

#include "client-hmd/main/options.h"
#include "client-hmd/mirror/model_feed.h"
#include "client-hmd/render/image.h"
#include "common/base/log.h"

namespace handloft::client {

class Pictures {
 public:
  /// Draws a still of the present state at full size.
  using Still = std::function<Result<Image>()>;

  /// `options` must outlive this.
  Pictures(const HmdOptions& options, Logger log, TimePoint started)
      : options_(options), log_(std::move(log)), started_(started) {}

  /// What has happened since the start.
  struct Moment {
    TimePoint now;
    const ModelState& model;
    std::uint64_t frames = 0;  ///< Drawn.
  };
  /// After every frame. True: the picture that was asked for has just been taken. Errors: io, what `still`
  /// says, or timeout when no scene came for `--once`.
  Result<bool> after_frame(const Moment& moment, const Still& still);
  /// After the last frame: takes what was asked for and not taken yet.
  Status at_end(const Still& still);
  /// A file of its own each time; a failure is told and no reason to end.
  void save_numbered(const Still& still);

  bool taken() const { return taken_; }

 private:
  Result<bool> due(const Moment& moment) const;
  Status take(const Still& still);

  const HmdOptions& options_;
  Logger log_;
  TimePoint started_;
  bool taken_ = false;
  int saved_ = 0;
};

}  // namespace handloft::client
