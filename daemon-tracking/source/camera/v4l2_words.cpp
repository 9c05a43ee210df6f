#include "daemon-tracking/source/camera/v4l2_words.h"

#include <fmt/format.h>

#include <cerrno>
#include <system_error>

namespace handloft::tracking {

namespace {

const char* in_words(CameraStep step) {
  switch (step) {
    case CameraStep::open:
      return "opening it";
    case CameraStep::query:
      return "asking what it is";
    case CameraStep::set_format:
      return "setting its picture format";
    case CameraStep::buffers:
      return "getting buffers";
    case CameraStep::start:
      return "starting its stream";
    case CameraStep::capture:
      return "fetching a frame";
  }
  return "using it";
}

}  // namespace

bool is_gone(int error) {
  return error == ENODEV || error == ENXIO || error == ENOENT;
}

Error camera_error(CameraStep step, int error, const std::string& node) {
  if (is_gone(error)) {
    return make_error(ErrorCode::not_found, fmt::format("{} is unplugged", node), node);
  }
  const std::string system = std::system_category().message(error);
  switch (error) {
    case EACCES:
    case EPERM:
      return make_error(ErrorCode::permission_denied,
                        fmt::format("{} may not be opened by this user: install deploy/udev's rule (uaccess) "
                                    "and plug the camera again, or add the user to the group 'video'",
                                    node),
                        node);
    case EBUSY:
      return make_error(
          ErrorCode::failed_precondition,
          fmt::format("{} is in use by another program: `fuser -v {}` names it; end it", node, node), node);
    case ENOSPC:
      return make_error(ErrorCode::resource_exhausted,
                        fmt::format("the USB bus has not enough bandwidth left for {}: plug it into another "
                                    "USB controller, or choose MJPEG, a lower rate or a smaller picture",
                                    node),
                        node);
    case EPROTO:
    case EILSEQ:
    case ETIMEDOUT:
    case EIO:
      return make_error(ErrorCode::io,
                        fmt::format("{} broke down while {} ({}): check its cable, hub and power", node,
                                    in_words(step), system),
                        node);
    default:
      return make_error(ErrorCode::io, fmt::format("{} refused {}: {}", node, in_words(step), system), node);
  }
}

}  // namespace handloft::tracking
