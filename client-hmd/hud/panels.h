#pragma once
// All panels over the picture (V7): bar, tools and commands, scene, view, settings, help, tour and notices.
// They show facts, answer with requests, and change nothing but what they look like. Input comes as events;
// what the panels take, nobody else gets. Works over a window and over an offscreen picture alike.
//
// All calls from one thread with a current OpenGL context, also the destructor.

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client-hmd/desktop/input.h"
#include "client-hmd/hud/notices.h"
#include "client-hmd/hud/panel_contents.h"
#include "client-hmd/hud/panel_layout.h"
#include "client-hmd/hud/panel_requests.h"
#include "client-hmd/hud/settings.h"
#include "client-hmd/hud/tour.h"

namespace handloft::client {

/// The right column's pages.
enum class PanelPage { scene, view, settings, help };

struct PanelFrame {
  int width_px = 1;
  int height_px = 1;
  float content_scale = 1.0F;  ///< Of the monitor: 1 for about 96 dots an inch.
  TimePoint now;
  unsigned target = 0;  ///< The framebuffer that is drawn over.
};

class Panels {
 public:
  /// Errors: not_found without a font; internal for a shader.
  static Result<std::unique_ptr<Panels>> create(const HudSettings& settings);
  ~Panels();
  Panels(const Panels&) = delete;
  Panels& operator=(const Panels&) = delete;

  /// In the order of the events. True: it was for the panels, and for nobody else. F1 opens the help, F6
  /// gives the panels the keyboard and takes it back.
  bool handle(const InputEvent& event);
  /// Tells what happened: refusals, exports.
  void tell(NoticeKind kind, std::string words, TimePoint now);
  /// A file was written: told, and noted for the tour.
  void tell_export(std::string words, TimePoint now);

  /// Draws everything; returns what was asked for since the frame before. Errors: io when a font cannot be
  /// read.
  Result<std::vector<PanelRequest>> draw(const PanelFacts& facts, const PanelFrame& frame);
  /// Events wait for a further frame (see Gui::add).
  bool has_more_input() const;

  const HudSettings& settings() const;
  const Tour& tour() const;
  const PanelLayout& layout() const;
  PanelPage page() const;
  void open(PanelPage page);
  void repeat_tour();

  /// Where a widget was in the frame before, by its name: "command:fit", "tool:lay", "shape:shape-1",
  /// "page:view", "tour:skip"; nullopt when it was not to be seen.
  std::optional<PixelRect> place_of(std::string_view widget) const;
  /// Whether a panel lies there.
  bool covers(const glm::dvec2& at_px) const;

 private:
  struct Implementation;
  explicit Panels(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace handloft::client
