#pragma once
// Kernel errors of a camera in words that say what to do about them (tracking.md 5.4): "No space left on
// device" from a camera means the USB bus is full.

#include <string>

#include "common/base/result.h"

namespace handloft::tracking {

/// What was being done when the kernel refused.
enum class CameraStep { open, query, set_format, buffers, start, capture };

/// `error` is the errno value, positive. The code is permission_denied for EACCES and EPERM, not_found for
/// ENODEV, ENXIO and ENOENT, resource_exhausted for ENOSPC, failed_precondition for EBUSY, io otherwise; the
/// field is the node.
Error camera_error(CameraStep step, int error, const std::string& node);

/// ENODEV, ENXIO, ENOENT: there is no such device any more.
bool is_gone(int error);

}  // namespace handloft::tracking
