#include "client-hmd/main/desktop_link.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "client-hmd/main/scene_extent.h"

namespace handloft::client {
namespace {

/// As many of a hand's frames as the server queues for one gesture (HandInboxOptions::of_gesture), so that a
/// slow frame's path arrives whole; the rest goes with the next frame.
constexpr int messages_per_frame = 60;
/// Twenty seconds of a path. Beyond, the server is not keeping up, and the oldest motion is given up.
constexpr std::size_t most_waiting = 4000;

/// Without a window nobody moves a hand, nor with two pictures side by side.
bool wants_hand(const HmdOptions& options) {
  return !options.offscreen && !options.once && !options.view_only && !options.stereo;
}

Status send_one(ModelFeed& feed, const HandMessage& message) {
  if (const auto* frame = std::get_if<v1::TrackingFrame>(&message)) return feed.send_hand(*frame);
  if (const auto* command = std::get_if<PaletteCommand>(&message)) return feed.send_command(*command);
  return feed.submit(std::get<v1::Operation>(message));
}

/// "delete_version" as people read it.
std::string in_words(std::string name) {
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

/// The scene with nothing but what is selected, or would be acted on.
Scene selected_of(const Scene& scene) {
  Scene selected;
  for (const auto& [id, entity] : scene.entities) {
    if (entity->selected) selected.entities.emplace(id, entity);
  }
  if (!selected.entities.empty()) return selected;
  for (const auto& [id, entity] : scene.entities) {
    if (entity->target) selected.entities.emplace(id, entity);
  }
  return selected;
}

DesktopOptions desktop_options(const HmdOptions& options) {
  DesktopOptions desktop;
  desktop.hand = wants_hand(options);
  return desktop;
}

}  // namespace

FeedOptions feed_options(const HmdOptions& options) {
  FeedOptions feed;
  if (!wants_hand(options)) return feed;
  feed.role = v1::ROLE_EDITOR;
  feed.name = options.name;
  const char* user = std::getenv("USER");
  if (feed.name.empty() && user != nullptr) feed.name = user;
  return feed;
}

DesktopLink::DesktopLink(const HmdOptions& options) : desktop_(desktop_options(options)) {}

InputWishes DesktopLink::handle(const DesktopInput& input, ModelFeed& feed, ViewState& view) {
  const std::shared_ptr<const ModelState> model = feed.state();
  const DesktopWorld world{*model->scene, view.orbit, input.size, view.camera == CameraMode::orbit};
  desktop_.set_connection({model->connected && model->takes_hands, model->own_client_id});
  for (const Acknowledgement& answer : feed.take_acknowledgements()) {
    if (!answer.refusal.empty()) {
      desktop_.on_refusal(fmt::format("{}: {}", in_words(answer.what), answer.refusal), input.now);
    } else if (!answer.notes.empty()) {
      desktop_.on_note(fmt::format("{}: {}", answer.what, answer.notes.front()), input.now);
    }
  }
  for (const DesktopCommand& command : input.commands) desktop_.on_command(command, input.now, world);
  // What panels took of the events is not among these; what they lie over now is not where they were.
  desktop_.set_taken({});
  for (const InputEvent& event : input.events) desktop_.on_event(event, world);
  desktop_.set_taken(input.taken);
  desktop_.on_frame(input.now, world);
  send(feed, *model, input.now);
  return apply(desktop_.take_wishes(), *model->scene, input.size, view);
}

void DesktopLink::send(ModelFeed& feed, const ModelState& model, TimePoint now) {
  // Another connection is another hand: what this one did before is not for it.
  if (std::exchange(client_id_, model.own_client_id) != model.own_client_id || !model.connected)
    outbox_.clear();
  for (HandMessage& message : desktop_.take_messages()) outbox_.push_back(std::move(message));
  while (outbox_.size() > most_waiting) outbox_.pop_front();
  for (int i = 0; i < messages_per_frame && !outbox_.empty(); ++i) {
    const Status sent = send_one(feed, outbox_.front());
    const bool motion = std::holds_alternative<v1::TrackingFrame>(outbox_.front());
    if (!sent && sent.error().code == ErrorCode::resource_exhausted && motion)
      return;  // With the next frame.
    if (!sent && !motion) desktop_.on_refusal(sent.error().message, now);
    outbox_.pop_front();
  }
}

InputWishes DesktopLink::apply(const DesktopWishes& wishes, const Scene& scene, PictureSize size,
                               ViewState& view) {
  InputWishes asked{.end = wishes.close, .screenshot = wishes.save_picture, .help = wishes.toggle_help};
  if (wishes.toggle_head) {
    view.camera = view.camera == CameraMode::head ? CameraMode::orbit : CameraMode::head;
    asked.film = view.camera == CameraMode::head;
  }
  if (wishes.toggle_distances) {
    view.distances = view.distances ? std::nullopt : std::optional(view.distance_scale);
  }
  if (wishes.toggle_zebra) view.shading = view.shading == Shading::zebra ? Shading::studio : Shading::zebra;
  if (wishes.next_light) view.shading = next_shading(view.shading);
  if (wishes.next_lines) view.overlays = next_overlays(view.overlays);
  if (wishes.frame_all) view.fit_wanted = true;
  if (wishes.frame_selected) {
    view.orbit.fit(visible_places(selected_of(scene)), size.width_px, size.height_px);
  }
  return asked;
}

void DesktopLink::add_to(Frame& frame) const {
  const DesktopState& state = desktop_.state();
  if (!state.cursor) return;
  CursorMark mark;
  mark.at = glm::vec3(*state.cursor);
  mark.normal = glm::vec3(state.cursor_normal);
  mark.plane_normal = glm::vec3(state.plane_normal);
  mark.on = state.snapped    ? CursorMark::On::point
            : state.on_shape ? CursorMark::On::shape
                             : CursorMark::On::plane;
  mark.pressure = static_cast<float>(state.pressure);
  mark.working = state.working;
  frame.cursor = mark;
  if (!state.working && state.disk_radius_m > 0.0 && !state.over.empty()) {
    frame.disks.push_back({mark.at, mark.normal, static_cast<float>(state.disk_radius_m),
                           static_cast<float>(state.range), std::nullopt});
  }
}

}  // namespace handloft::client
