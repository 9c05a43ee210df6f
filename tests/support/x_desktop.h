#pragma once
// A display of one's own (Xvfb), with synthetic mouse and keys (XTest): for tests of real windows. Nobody
// else's display is touched, and several may run at a time.

#include <X11/Xlib.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/process.h"

namespace handloft::test {

struct Pixel {
  int x = 0, y = 0;
};

class XDesktop {
 public:
  /// Throws std::runtime_error when there is no Xvfb, or it does not start.
  XDesktop(int width_px, int height_px, const std::filesystem::path& log);
  XDesktop(const XDesktop&) = delete;
  XDesktop& operator=(const XDesktop&) = delete;

  /// For the environment of programs: "DISPLAY=:99".
  std::string environment() const { return "DISPLAY=" + name_; }
  /// Waits until a window of that title is shown, and gives it the keyboard; false when the time is up.
  bool focus(const std::string& title, std::chrono::milliseconds timeout);

  // Within the focused window. They return at once: what comes of them is to be waited for.
  void move_to(Pixel at);
  /// As a mouse does, some pixels at a time: through the places of way().
  void glide_to(Pixel to);
  static std::vector<Pixel> way(Pixel from, Pixel to);
  void button(unsigned number, bool down);
  /// X's name of it: "Return", "1", "Prior", "Control_L".
  void key(const std::string& name, bool down);
  void type(const std::string& name);
  void type_with(const std::string& modifier, const std::string& name);

 private:
  struct CloseDisplay {
    void operator()(Display* display) const { XCloseDisplay(display); }
  };
  std::optional<Window> find(Window under, const std::string& title) const;

  std::unique_ptr<Process> server_;
  std::string name_;
  std::unique_ptr<Display, CloseDisplay> display_;
  Pixel window_at_;
  Pixel at_;
};

}  // namespace handloft::test
