#include "tests/support/x_desktop.h"

#include <X11/Xutil.h>
#include <X11/extensions/XTest.h>
#include <poll.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace handloft::test {
namespace {

constexpr auto server_start = std::chrono::seconds(30);
/// Between two reports of the mouse.
constexpr double step_px = 4.0;

}  // namespace

XDesktop::XDesktop(int width_px, int height_px, const std::filesystem::path& log) {
  const std::string screen = std::to_string(width_px) + "x" + std::to_string(height_px) + "x24";
  // The server chooses a free number and tells it when it is ready.
  server_ = std::make_unique<Process>(std::vector<std::string>{"/usr/bin/Xvfb", "-displayfd", "1", "-screen",
                                                               "0", screen, "-nolisten", "tcp"},
                                      log);
  const auto number = server_->read_line(server_start);
  if (!number) throw std::runtime_error("Xvfb did not start: " + server_->error_output());
  name_ = ":" + *number;
  display_.reset(XOpenDisplay(name_.c_str()));
  if (display_ == nullptr) throw std::runtime_error("cannot open display " + name_);
  XSelectInput(display_.get(), DefaultRootWindow(display_.get()), SubstructureNotifyMask);
  XFlush(display_.get());
}

std::optional<Window> XDesktop::find(Window under, const std::string& title) const {
  Window root = 0, parent = 0;
  Window* children = nullptr;
  unsigned count = 0;
  if (XQueryTree(display_.get(), under, &root, &parent, &children, &count) == 0) return std::nullopt;
  std::optional<Window> found;
  for (unsigned i = 0; i < count && !found; ++i) {
    char* name = nullptr;
    XWindowAttributes attributes;
    const bool shown = XGetWindowAttributes(display_.get(), children[i], &attributes) != 0 &&
                       attributes.map_state == IsViewable;
    if (shown && XFetchName(display_.get(), children[i], &name) != 0 && name == title) found = children[i];
    if (name != nullptr) XFree(name);
  }
  if (children != nullptr) XFree(children);
  return found;
}

bool XDesktop::focus(const std::string& title, std::chrono::milliseconds timeout) {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  const Window root = DefaultRootWindow(display_.get());
  while (true) {
    if (const auto window = find(root, title)) {
      Window child = 0;
      XTranslateCoordinates(display_.get(), *window, root, 0, 0, &window_at_.x, &window_at_.y, &child);
      XSetInputFocus(display_.get(), *window, RevertToPointerRoot, CurrentTime);
      XSync(display_.get(), False);
      return true;
    }
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    if (left.count() <= 0) return false;
    pollfd waiting{ConnectionNumber(display_.get()), POLLIN, 0};
    if (XPending(display_.get()) == 0) ::poll(&waiting, 1, static_cast<int>(left.count()));
    while (XPending(display_.get()) > 0) {
      XEvent event;
      XNextEvent(display_.get(), &event);
    }
  }
}

void XDesktop::move_to(Pixel at) {
  at_ = at;
  XTestFakeMotionEvent(display_.get(), -1, window_at_.x + at.x, window_at_.y + at.y, CurrentTime);
  XFlush(display_.get());
}

std::vector<Pixel> XDesktop::way(Pixel from, Pixel to) {
  const int steps = std::max(1, static_cast<int>(std::hypot(to.x - from.x, to.y - from.y) / step_px));
  std::vector<Pixel> places{from};
  for (int i = 1; i <= steps; ++i) {
    const double share = static_cast<double>(i) / steps;
    places.push_back({static_cast<int>(std::lround(from.x + (to.x - from.x) * share)),
                      static_cast<int>(std::lround(from.y + (to.y - from.y) * share))});
  }
  return places;
}

void XDesktop::glide_to(Pixel to) {
  const std::vector<Pixel> places = way(at_, to);
  for (std::size_t i = 1; i < places.size(); ++i) move_to(places[i]);
}

void XDesktop::button(unsigned number, bool down) {
  XTestFakeButtonEvent(display_.get(), number, down ? True : False, CurrentTime);
  XFlush(display_.get());
}

void XDesktop::key(const std::string& name, bool down) {
  const KeyCode code = XKeysymToKeycode(display_.get(), XStringToKeysym(name.c_str()));
  if (code == 0) throw std::runtime_error("no key \"" + name + "\"");
  XTestFakeKeyEvent(display_.get(), code, down ? True : False, CurrentTime);
  XFlush(display_.get());
}

void XDesktop::type(const std::string& name) {
  key(name, true);
  key(name, false);
}

void XDesktop::type_with(const std::string& modifier, const std::string& name) {
  key(modifier, true);
  type(name);
  key(modifier, false);
}

}  // namespace handloft::test
