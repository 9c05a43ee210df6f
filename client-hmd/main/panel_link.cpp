#include "client-hmd/main/panel_link.h"

#include <fmt/format.h>

#include <utility>

#include "client-hmd/desktop/key_map.h"
#include "client-hmd/main/panel_operations.h"

namespace handloft::client {
ViewChoices view_choices(const ViewState& view) {
  ViewChoices choices;
  choices.shading = view.shading;
  choices.curvature = view.curvature.kind;
  choices.overlays = view.overlays;
  choices.distances = view.distances.has_value();
  choices.follow_head = view.camera == CameraMode::head;
  return choices;
}

PanelLink::PanelLink(std::filesystem::path path, Logger log) : file_(std::move(path)), log_(std::move(log)) {
  SettingsFile::Loaded loaded = file_.load();
  settings_ = loaded.settings;
  warning_ = std::move(loaded.warning);
  if (!warning_.empty()) log_.warning("{}", warning_);
}

Status PanelLink::show() {
  Result<std::unique_ptr<Panels>> panels = Panels::create(settings_);
  if (!panels) return panels.error();
  panels_ = std::move(*panels);
  return {};
}

void PanelLink::hide() {
  panels_.reset();
}

std::optional<PixelRect> PanelLink::free_part() const {
  if (panels_ == nullptr) return std::nullopt;
  return panels_->layout().middle;
}

PanelledInput PanelLink::take(const std::vector<InputEvent>& events, ModelFeed& feed, ViewState& view,
                              TimePoint now) {
  PanelledInput input;
  if (panels_ == nullptr) {
    input.events = events;
    return input;
  }
  for (const InputEvent& event : events) {
    const bool ours = panels_->handle(event);
    if (std::holds_alternative<PointerMoved>(event.what)) pointer_taken_ = ours;
    if (!ours) input.events.push_back(event);
  }
  input.taken.pointer = pointer_taken_;
  for (const PanelRequest& request : std::exchange(requests_, {})) carry_out(request, feed, view, input, now);
  return input;
}

void PanelLink::carry_out(const PanelRequest& request, ModelFeed& feed, ViewState& view, PanelledInput& input,
                          TimePoint now) {
  if (const auto* command = std::get_if<DesktopCommand>(&request)) {
    input.commands.push_back(*command);
  } else if (const auto* versions = std::get_if<CompareVersions>(&request)) {
    feed.ask_difference(versions->from, versions->to);
  } else if (const auto* change = std::get_if<ChangeView>(&request)) {
    change_view(change->choices, view, input);
  } else if (const auto* settings = std::get_if<ChangeSettings>(&request)) {
    keep(settings->settings, now);
  } else if (const std::optional<v1::Operation> operation = operation_of(request)) {
    submit(feed, *operation, now);
  }
}

void PanelLink::submit(ModelFeed& feed, const v1::Operation& operation, TimePoint now) {
  if (const Status sent = feed.submit(operation); !sent) {
    panels_->tell(NoticeKind::refused, sent.error().message, now);
  }
}

void PanelLink::change_view(const ViewChoices& choices, ViewState& view, PanelledInput& input) {
  view.shading = choices.shading;
  view.curvature.kind = choices.curvature;
  view.overlays = choices.overlays;
  if (choices.distances != view.distances.has_value()) {
    view.distances = choices.distances ? std::optional(view.distance_scale) : std::nullopt;
  }
  // The film has to be asked for, too: as the key does.
  if (choices.follow_head != (view.camera == CameraMode::head)) {
    input.commands.push_back({DesktopAction::toggle_head, {}, {}});
  }
}

void PanelLink::keep(const HudSettings& settings, TimePoint now) {
  if (settings == settings_) return;
  settings_ = settings;
  const Status saved = file_.save(settings);
  if (saved.ok()) return;
  log_.warning("settings are not kept: {}", saved.error().describe());
  panels_->tell(NoticeKind::warning, "Your settings are not kept: " + saved.error().message, now);
}

double PanelLink::frame_rate(TimePoint now) {
  constexpr double share = 0.05;  // About the last twenty frames: a figure that can be read.
  if (drawn_at_ && now > *drawn_at_) {
    const double seconds = to_seconds(now - *drawn_at_);
    frame_seconds_ = frame_seconds_ > 0.0 ? (1.0 - share) * frame_seconds_ + share * seconds : seconds;
  }
  drawn_at_ = now;
  return frame_seconds_ > 0.0 ? 1.0 / frame_seconds_ : 0.0;
}

void PanelLink::tell_news(const PanelledPicture& picture) {
  if (!warning_.empty()) panels_->tell(NoticeKind::warning, std::exchange(warning_, {}), picture.now);
  const DesktopState& desktop = picture.desktop;
  // The same words twice are two refusals.
  if (desktop.refusals != refusals_) panels_->tell(NoticeKind::refused, desktop.refusal, picture.now);
  if (desktop.note != note_) {
    if (desktop.note.starts_with("export")) {
      panels_->tell_export(desktop.note, picture.now);
    } else {
      panels_->tell(NoticeKind::done, desktop.note, picture.now);
    }
  }
  refusals_ = desktop.refusals;
  note_ = desktop.note;
}

Status PanelLink::draw(const PanelledPicture& picture) {
  if (panels_ == nullptr) return {};
  tell_news(picture);
  const TrackingStatus tracking =
      picture.sources.tracking == nullptr ? TrackingStatus{} : picture.sources.tracking->status();
  const PanelFacts facts{.model = *picture.sources.model,
                         .tracking = tracking,
                         .tracking_wanted = picture.sources.tracking != nullptr,
                         .lag = model_lag(tracking, *picture.sources.model, picture.now),
                         .latency_ms = picture.latency_ms,
                         .frames_per_second = frame_rate(picture.now),
                         .desktop = picture.desktop,
                         .view = view_choices(picture.view),
                         .colours = settings_.colours,
                         .keys = key_help()};
  Result<std::vector<PanelRequest>> requests = panels_->draw(
      facts, {picture.width_px, picture.height_px, picture.content_scale, picture.now, picture.target});
  if (!requests) return requests.error();
  for (PanelRequest& request : *requests) requests_.push_back(std::move(request));
  return {};
}

}  // namespace handloft::client
