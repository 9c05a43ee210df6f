#pragma once
// The desktop's tools in words, for people who use them for the first time.

#include <string_view>

#include "client-hmd/desktop/desktop_state.h"

namespace handloft::client {

/// "Lay points"
std::string_view words_of(DesktopTool tool);
/// One sentence: what the pointer does with it, over an icon or not.
std::string_view hint_of(DesktopTool tool, bool over_icon);
/// Of the disk that pushes by that pressure (A13; geometry::DiskOptions).
double disk_radius_m(double pressure);

}  // namespace handloft::client
