#pragma once
// Between the panels and everything that they show and ask for: settings from and to their file, events to
// the panels before anybody else, requests to the view and the model server, and what the server said as
// notices. Nothing here waits; without panels everything passes through.

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client-hmd/desktop/desktop.h"
#include "client-hmd/hud/panels.h"
#include "client-hmd/main/frame_composer.h"
#include "client-hmd/main/options.h"
#include "client-hmd/main/view_state.h"
#include "client-hmd/mirror/model_feed.h"
#include "common/base/log.h"

namespace handloft::client {

/// What panels leave of a frame's input, and what they ask of the desktop's hand.
struct PanelledInput {
  std::vector<InputEvent> events;
  std::vector<DesktopCommand> commands;
  InputTaken taken;
};

/// A finished picture that panels are drawn over, and what they tell of.
struct PanelledPicture {
  int width_px = 1;
  int height_px = 1;
  float content_scale = 1.0F;  ///< Of the monitor.
  unsigned target = 0;         ///< Framebuffer.
  TimePoint now;
  const FrameSources& sources;
  const DesktopState& desktop;
  const ViewState& view;
  double latency_ms = 0.0;
};

class PanelLink {
 public:
  /// Reads the person's settings; a file that cannot be read is logged and told in the panels. `path`: as
  /// settings_path().
  PanelLink(std::filesystem::path path, Logger log);

  /// From now on there are panels. Needs a current OpenGL context. Errors: as Panels::create().
  Status show();
  /// Their OpenGL context is gone, or about to go: show() makes them anew.
  void hide();
  bool shown() const { return panels_ != nullptr; }

  /// Once a frame, before the desktop's hand: what the panels take is not passed on. Requests of the frame
  /// before are carried out.
  PanelledInput take(const std::vector<InputEvent>& events, ModelFeed& feed, ViewState& view, TimePoint now);
  /// Over the finished picture. Errors: as Panels::draw().
  Status draw(const PanelledPicture& picture);

  /// Of the person's setting.
  ColourScheme colours() const { return settings_.colours; }
  /// The part of the picture that panels left in the frame before; nullopt without panels.
  std::optional<PixelRect> free_part() const;

 private:
  void carry_out(const PanelRequest& request, ModelFeed& feed, ViewState& view, PanelledInput& input,
                 TimePoint now);
  void submit(ModelFeed& feed, const v1::Operation& operation, TimePoint now);
  void change_view(const ViewChoices& choices, ViewState& view, PanelledInput& input);
  void keep(const HudSettings& settings, TimePoint now);
  void tell_news(const PanelledPicture& picture);
  double frame_rate(TimePoint now);

  SettingsFile file_;
  Logger log_;
  HudSettings settings_;
  std::string warning_;  ///< About the settings; told once there are panels.
  std::unique_ptr<Panels> panels_;
  std::vector<PanelRequest> requests_;
  bool pointer_taken_ = false;
  std::uint64_t refusals_ = 0;  ///< Told so far.
  std::string note_;            ///< Told last.
  std::optional<TimePoint> drawn_at_;
  double frame_seconds_ = 0.0;  ///< Smoothed.
};

/// What panels show of a view.
ViewChoices view_choices(const ViewState& view);

}  // namespace handloft::client
