#pragma once
// Dear ImGui as a value that owns everything of it: context, fonts, and what draws its lists with OpenGL.
// Input comes as the desktop's events, so that a window and a test drive it alike; it draws over whatever is
// in the framebuffer, sRGB values as they are. Works with any OpenGL 3.3 core context, a window's or EGL's
// offscreen.
//
// All calls from one thread with that context current, also the destructor.

#include <deque>
#include <memory>
#include <set>
#include <string>

#include "client-hmd/desktop/input.h"
#include "client-hmd/hud/theme.h"
#include "client-hmd/render/gl.h"
#include "common/base/result.h"

struct ImGuiContext;
struct ImFont;
struct ImFontAtlas;
struct ImDrawData;

namespace handloft::client {

/// The typefaces of panels: null before the first begin().
struct GuiFonts {
  ImFont* text = nullptr;
  ImFont* bold = nullptr;
  ImFont* small = nullptr;  ///< small_text_share of the text's height.
  ImFont* sign = nullptr;   ///< sign_share of it; for the palette's signs.
};

inline constexpr float small_text_share = 0.82F, sign_share_of_text = 1.45F;

/// What a frame of panels is drawn for.
struct GuiFrame {
  int width_px = 1;
  int height_px = 1;
  float text_px = 15.0F;        ///< Height of the text.
  double seconds = 1.0 / 60.0;  ///< Since the frame before.
};

class Gui {
 public:
  /// Errors: not_found without a font, naming a package; internal for a shader.
  static Result<std::unique_ptr<Gui>> create();
  ~Gui();
  Gui(const Gui&) = delete;
  Gui& operator=(const Gui&) = delete;

  /// Kept until begin(). A button that goes down and up takes two frames, so that neither is missed.
  void add(const InputEvent& event);
  /// Whether events wait for a further frame.
  bool has_more_input() const { return !waiting_.empty(); }

  /// Makes the context current for ImGui's functions; loads fonts when the text's height has changed. Errors:
  /// io when a font cannot be read.
  Status begin(const GuiFrame& frame, const Theme& theme);
  /// Draws into framebuffer `target`. Leaves blending, scissors and depth test off.
  void end(unsigned target);

  const GuiFonts& fonts() const { return fonts_; }
  /// A field of text has the keyboard.
  bool takes_text() const;
  /// Keys move the focus from widget to widget, or no longer.
  void navigate_by_keys(bool on);

 private:
  Gui() = default;
  Status load_fonts(float text_px);
  void apply_style(const Theme& theme, float text_px);
  bool apply(const InputEvent& event, std::set<std::string>& changed);
  void draw(const ImDrawData& data);

  ImGuiContext* context_ = nullptr;
  std::unique_ptr<ImFontAtlas> atlas_;
  GuiFonts fonts_;
  float text_px_ = 0.0F;
  std::string text_file_, bold_file_;
  std::deque<InputEvent> waiting_;
  GlProgram program_;
  GlVertexArray array_;
  GlBuffer vertices_, indices_;
  GlTexture font_texture_;
};

}  // namespace handloft::client
