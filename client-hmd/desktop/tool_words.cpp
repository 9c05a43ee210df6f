#include "client-hmd/desktop/tool_words.h"

namespace handloft::client {
namespace {

constexpr double least_radius_m = 0.005;
constexpr double most_radius_m = 0.060;

}  // namespace

std::string_view words_of(DesktopTool tool) {
  switch (tool) {
    case DesktopTool::lay:
      return "Lay points";
    case DesktopTool::push:
      return "Push and drag";
    case DesktopTool::draw:
      return "Draw";
    case DesktopTool::trim:
      return "Trim";
    case DesktopTool::move:
      return "Move";
    case DesktopTool::region:
      return "Region icon";
  }
  return "";
}

std::string_view hint_of(DesktopTool tool, bool over_icon) {
  switch (tool) {
    case DesktopTool::lay:
      return "Hold the left button and draw: points lie where the cursor goes, as sure as you press. Enter "
             "fits a surface.";
    case DesktopTool::push:
      return over_icon
                 ? "Hold and drag the icon along its normal; Q and E turn it, L lets it go in the work plane."
                 : "Hold on a shape and move: up pushes it outwards, down inwards; [ and ] set the range.";
    case DesktopTool::draw:
      return "Draw a profile: the surface follows at once. On a sculpted surface a tap adds a point, a line "
             "a curve.";
    case DesktopTool::trim:
      return "Draw a closed curve: the surface is kept inside it.";
    case DesktopTool::move:
      return "Hold a shape and move it; Q, E and the arrows turn it, [ and ] change its size.";
    case DesktopTool::region:
      return "Drag over a sculpted surface from one corner of the region to the other.";
  }
  return "";
}

double disk_radius_m(double pressure) {
  return least_radius_m + (most_radius_m - least_radius_m) * pressure;
}

}  // namespace handloft::client
