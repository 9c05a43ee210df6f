#include "client-hmd/main/pictures.h"

#include <fmt/format.h>

namespace handloft::client {
namespace {

constexpr auto idle_after = std::chrono::seconds(1);
constexpr auto once_settled_after =
    std::chrono::milliseconds(200);  ///< Large scenes come in several messages.
constexpr auto once_patience = std::chrono::seconds(10);

}  // namespace

Result<bool> Pictures::due(const Moment& moment) const {
  if (options_.screenshot.empty() || taken_) return false;
  if (options_.once || options_.screenshot_time == ScreenshotTime::idle) {
    const Duration quiet = options_.once ? Duration(once_settled_after) : Duration(idle_after);
    if (options_.once && moment.model.snapshots == 0 && moment.now - started_ > once_patience) {
      return make_error(ErrorCode::timeout,
                        "no scene came from the model server" +
                            (moment.model.problem.empty() ? "" : ": " + moment.model.problem));
    }
    return moment.model.snapshots > 0 && moment.now - moment.model.received_at >= quiet;
  }
  return options_.screenshot_time == ScreenshotTime::frames && moment.frames >= options_.screenshot_frames;
}

Result<bool> Pictures::after_frame(const Moment& moment, const Still& still) {
  const Result<bool> wanted = due(moment);
  if (!wanted || !*wanted) return wanted;
  if (const Status status = take(still); !status) return status.error();
  return true;
}

Status Pictures::at_end(const Still& still) {
  if (options_.screenshot.empty() || taken_) return {};
  return take(still);
}

Status Pictures::take(const Still& still) {
  const Result<Image> image = still();
  if (!image) return image.error();
  taken_ = true;
  return write_png(options_.screenshot, *image);
}

void Pictures::save_numbered(const Still& still) {
  const std::string path = fmt::format("handloft-{}.png", ++saved_);
  const Result<Image> image = still();
  const Status saved = image ? write_png(path, *image) : Status(image.error());
  if (saved.ok()) {
    log_.info("saved {}", path);
  } else {
    log_.warning("no screenshot: {}", saved.error().describe());
  }
}

}  // namespace handloft::client
