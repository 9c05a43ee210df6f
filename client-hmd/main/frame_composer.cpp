#include "client-hmd/main/frame_composer.h"

#include <algorithm>
#include <cmath>

#include "client-hmd/hud/table_card.h"
#include "client-hmd/view/late_turn.h"

namespace handloft::client {
namespace {

constexpr double head_fov_y_rad =
    0.80;  ///< Without film: about what a headset's lower half of the view shows.
constexpr std::size_t min_fingers_for_centre = 3;

// The default rig's caps, thumb to little finger, as sRGB: until the daemon tells its own.
constexpr std::array<std::uint32_t, finger_count> default_finger_colours{0xDC2833, 0x28BD3B, 0x2846DC,
                                                                         0xE6D11E, 0xD232C8};
constexpr float predicted_opacity = 0.5F;

// IEC 61966-2-1, for one channel of 0x00RRGGBB.
float linear_channel(std::uint32_t colour, unsigned shift) {
  const float encoded = static_cast<float>(colour >> shift & 0xFFU) / 255.0F;
  return encoded <= 0.04045F ? encoded / 12.92F : std::pow((encoded + 0.055F) / 1.055F, 2.4F);
}

glm::vec3 linear_colour(std::uint32_t srgb) {
  return {linear_channel(srgb, 16), linear_channel(srgb, 8), linear_channel(srgb, 0)};
}

struct Viewpoint {
  Eye eye;
  TimePoint time;  ///< When everything is where it is drawn.
  std::optional<FilmedPicture> film;
  std::optional<HeadView> head;
  int margin_px = 0;
};

/// The film fills what is shown and the margin about it.
void look_through_film(const Pinhole& camera, const FrameRequest& request, Viewpoint& view) {
  Pinhole shown = covering_pinhole(camera, request.width_px, request.height_px);
  constexpr int rounds = 2;  // A margin enlarges the picture, and that the margin: by less every time.
  for (int i = 0; i < rounds; ++i) {
    view.margin_px = margin_for_turn(shown, request.largest_turn_rad);
    view.eye.pinhole = covering_pinhole(camera, request.width_px + 2 * view.margin_px,
                                        request.height_px + 2 * view.margin_px);
    shown = widened(view.eye.pinhole, -view.margin_px);
  }
}

std::optional<Viewpoint> film_viewpoint(const FrameRequest& request, const FrameSources& sources,
                                        const TrackingStatus& status) {
  if (sources.film == nullptr) return std::nullopt;
  const auto camera = std::find_if(status.cameras.begin(), status.cameras.end(),
                                   [](const FilmCamera& candidate) { return candidate.on_head; });
  if (camera == status.cameras.end()) return std::nullopt;
  const std::shared_ptr<const FilmFrame> picture = sources.film->newest(camera->index);
  if (picture == nullptr || picture->camera != camera->index ||
      picture->width_px != camera->pinhole.width_px || picture->height_px != camera->pinhole.height_px) {
    return std::nullopt;
  }
  const std::optional<PoseAnswer> pose = sources.tracking->camera_at(camera->index, picture->exposure_time);
  if (!pose) return std::nullopt;
  Viewpoint view;
  view.eye.world_from_eye = eye_from_camera_axes(pose->pose);
  look_through_film(camera->pinhole, request, view);
  view.time = picture->exposure_time;
  auto image = std::make_shared<Image>(Image{picture->width_px, picture->height_px, picture->rgba});
  view.film = FilmedPicture{std::move(image), picture->serial, camera->pinhole};
  if (const std::optional<PoseAnswer> head = sources.tracking->head_at(view.time)) {
    view.head = HeadView{view.time, head->pose};
  }
  return view;
}

Viewpoint choose_viewpoint(const FrameRequest& request, const FrameSources& sources,
                           const TrackingStatus& status) {
  Viewpoint view;
  view.time = request.display_time;
  if (request.camera == CameraMode::head && sources.tracking != nullptr) {
    if (std::optional<Viewpoint> film = film_viewpoint(request, sources, status)) return std::move(*film);
    if (const std::optional<PoseAnswer> head = sources.tracking->head_at(request.display_time)) {
      view.eye.world_from_eye = head->pose;
      const Pinhole shown = centred_pinhole(request.width_px, request.height_px, head_fov_y_rad);
      view.margin_px = margin_for_turn(shown, request.largest_turn_rad);
      view.eye.pinhole = widened(shown, view.margin_px);
      view.head = HeadView{view.time, head->pose};
      return view;
    }
  }
  view.eye = request.orbit.eye(request.width_px, request.height_px);
  return view;
}

/// For what the film shows of our hand to hide what is behind it.
FilmedHand filmed_hand(const std::array<std::optional<FingerAnswer>, finger_count>& fingers,
                       const HandStatus& hand) {
  static_assert(finger_count == tips_of_a_hand);
  FilmedHand filmed;
  for (std::size_t i = 0; i < finger_count; ++i) {
    if (!fingers[i]) continue;
    filmed.tips[i] = HandTip{glm::vec3(fingers[i]->position), fingers[i]->seen ? 1.0F : predicted_opacity};
  }
  switch (hand.gesture) {
    case v1::GESTURE_CLOSED:
      filmed.posture = HandPosture::closed;
      break;
    case v1::GESTURE_POINTING:
      filmed.posture = HandPosture::pointing;
      break;
    default:
      break;
  }
  return filmed;
}

void add_cursor(const std::array<std::optional<FingerAnswer>, finger_count>& fingers, const HandStatus& hand,
                const std::array<std::uint32_t, finger_count>& colours, Frame& frame) {
  glm::dvec3 sum(0.0);
  std::size_t count = 0;
  for (std::size_t i = 0; i < finger_count; ++i) {
    if (!fingers[i]) continue;
    frame.fingers.push_back({glm::vec3(fingers[i]->position), linear_colour(colours[i]),
                             fingers[i]->seen ? 1.0F : predicted_opacity});
    sum += fingers[i]->position;
    ++count;
  }
  if (count < min_fingers_for_centre) return;
  const glm::dvec3 centre = sum / static_cast<double>(count);
  if (hand.gesture == v1::GESTURE_ON_TABLE) {
    frame.touched = palette_command_at(centre.x, centre.y, frame.palette_page);
  } else if (hand.gesture == v1::GESTURE_OPEN) {
    frame.pressure = PressureMark{glm::vec3(centre), static_cast<float>(hand.pressure), hand.pressing};
  }
}

glm::vec3 vec(const Vec3f& v) {
  return {v.x, v.y, v.z};
}

void add_symmetry(const ModelState& model, Frame& frame) {
  for (const auto& [key, activity] : model.activities) {
    if (!activity.symmetry || !activity.symmetry_plane || frame.symmetry) continue;
    frame.symmetry = SymmetryHint{vec(activity.symmetry_plane->origin), vec(activity.symmetry_plane->normal)};
  }
}

/// As the hand's server tells; peers have tables of their own.
int palette_page(const ModelState& model) {
  for (const auto& [key, activity] : model.activities) {
    if (activity.client_id == 0 && activity.palette_page > 0 &&
        activity.palette_page <= static_cast<std::uint32_t>(palette_pages)) {
      return static_cast<int>(activity.palette_page);
    }
  }
  return first_palette_page;
}

/// Whose hand the server's own tracking follows: ours while we hear the same daemon.
TrackedHand tracked_hand(const TrackingStatus& tracking) {
  return tracking.connected || tracking.end_of_recording ? TrackedHand::ours : TrackedHand::somebodys;
}

/// What ghosts do comes with them.
void add_gestures(const FrameSources& sources, TrackedHand tracked, Frame& frame) {
  const ModelState& model = *sources.model;
  if (!model.connected) return;  // What hung in the air when the line broke is no longer known.
  for (const auto& [key, activity] : model.activities) {
    if (sources.ghosts != nullptr && !is_ours(key, model.own_client_id, tracked)) continue;
    if (activity.disk) {
      frame.disks.push_back({vec(activity.disk->centre), vec(activity.disk->normal), activity.disk->radius_m,
                             activity.range, std::nullopt});
    }
    if (activity.curve != nullptr) frame.air_curves.push_back(activity.curve);
  }
}

/// Comments that are open, numbered as in the panels.
void add_pins(const FrameRequest& request, const FrameSources& sources, Frame& frame) {
  const Scene& scene = *sources.model->scene;
  if (scene.comments == nullptr) return;
  int number = 0;
  for (const PinnedComment* comment : open_threads(*scene.comments)) {
    ++number;
    if (!comment->placed) continue;
    const glm::vec3 place = sources.pins == nullptr ? glm::vec3(comment->x, comment->y, comment->z)
                                                    : sources.pins->place_of(*comment);
    frame.pins.push_back({place, number, linear_rgb(user_colour(comment->client_id, request.colours))});
  }
}

/// Others' leases: one's own needs no telling.
void add_holders(const FrameRequest& request, const ModelState& model, Frame& frame) {
  if (!model.connected) return;
  for (const auto& [id, entity] : model.scene->entities) {
    if (entity->leased_by == 0 || entity->leased_by == model.own_client_id) continue;
    frame.holders.push_back({id, entity->leased_by_name.empty() ? "somebody" : entity->leased_by_name,
                             linear_rgb(user_colour(entity->leased_by, request.colours))});
  }
}

/// What is held counts before what is aimed at.
void add_icons(const std::vector<SceneIcon>& icons, HudStatus& status) {
  status.icons += icons.size();
  for (const SceneIcon& icon : icons) {
    if (!icon.held && (!icon.target || !status.icon.empty())) continue;
    status.icon = icon.id;
    status.icon_held = icon.held;
  }
}

HudStatus hud_status(const FrameRequest& request, const FrameSources& sources,
                     const TrackingStatus& tracking) {
  const ModelState& model = *sources.model;
  HudStatus status;
  status.model_connected = model.connected;
  status.has_scene = model.snapshots > 0;
  status.tracking_wanted = sources.tracking != nullptr;
  // A recording that ended is no fault.
  status.tracking_connected = tracking.connected || tracking.end_of_recording;
  status.lag = model_lag(tracking, model, request.now);
  if (request.latency_ms > 0.0) status.latency_ms = request.latency_ms;
  status.hand = tracking.hand;
  for (const auto& [key, activity] : model.activities) {
    if (!activity.tool.empty() && status.tool.empty()) status.tool = activity.tool;
    if (status.mode.empty() && activity.client_id == 0) status.mode = activity.mode;
    if (activity.disk && !status.range) {
      status.range = activity.range;
      status.smooth_falloff = activity.smooth_falloff;
    }
    status.symmetry = status.symmetry || activity.symmetry;
    if (!activity.name.empty() && activity.client_id != 0 && activity.client_id != model.own_client_id) {
      status.others.push_back(activity.name);
      status.other_ids.push_back(activity.client_id);
    }
  }
  status.history = model.scene->history;
  status.alternatives = model.scene->alternatives;
  status.colours = request.colours;
  status.distances = request.distances;
  for (const auto& [id, entity] : model.scene->entities) {
    if (entity->kind == EntityKind::reference) {
      ++status.references;
    } else {
      ++status.shapes;
      if (entity->surface != nullptr) ++status.surfaces;
      if (entity->distances_m != nullptr) ++status.compared;
    }
    if (entity->icons != nullptr) add_icons(*entity->icons, status);
    if (entity->points != nullptr) status.points += entity->points->points.size();
    if (entity->selected) {
      status.selected = entity->name;
      status.representation = entity->representation;
    } else if (entity->target) {
      status.target = entity->name;
    }
  }
  return status;
}

void add_hud(const FrameRequest& request, const HudStatus& status,
             const std::function<float(std::string_view)>& measure, Frame& frame) {
  switch (request.hud) {
    case HudPlace::edges:
      frame.overlay = layout_hud(status, request.width_px, request.height_px, measure);
      break;
    case HudPlace::legends:
      frame.overlay = layout_legends(status, request.hud_corner_px, request.hud_size_px, measure);
      break;
    case HudPlace::table:
      frame.sheets.push_back(table_card(
          status, request.colours, measure,
          table_card_place(request.eye_focal_px > 0.0 ? request.eye_focal_px : frame.eye.pinhole.fy_px)));
      break;
  }
}

}  // namespace

Frame compose_frame(const FrameRequest& request, const FrameSources& sources,
                    const std::function<float(std::string_view)>& measure) {
  const TrackingStatus tracking = sources.tracking == nullptr ? TrackingStatus{} : sources.tracking->status();
  Viewpoint view = choose_viewpoint(request, sources, tracking);
  Frame frame;
  frame.scene = sources.model->scene;
  frame.eye = view.eye;
  frame.film = std::move(view.film);
  frame.head = view.head;
  frame.margin_px = view.margin_px;
  frame.distances = request.distances;
  frame.colours = request.colours;
  frame.shading = request.shading;
  frame.curvature = request.curvature;
  frame.overlays = request.overlays;
  frame.edges = request.edges;
  frame.surroundings = request.surroundings;
  frame.control_nets = sources.model->control_nets;
  frame.palette_page = palette_page(*sources.model);
  if (tracking.hand) {
    const auto fingers = sources.tracking->fingers_at(view.time);
    add_cursor(fingers, *tracking.hand, tracking.finger_colours.value_or(default_finger_colours), frame);
    if (frame.film) frame.filmed_hand = filmed_hand(fingers, *tracking.hand);
  }
  const HudStatus status = hud_status(request, sources, tracking);
  // A plane for the hand that draws; in a picture without one it would only stand in the way.
  if (tracking.hand && !tracking.end_of_recording) add_symmetry(*sources.model, frame);
  add_gestures(sources, tracked_hand(tracking), frame);
  if (request.surroundings == Surroundings::workplace) {
    add_pins(request, sources, frame);
    add_holders(request, *sources.model, frame);
  }
  frame.hand_occlusion = request.hand_occlusion;
  if (sources.ghosts != nullptr) {
    frame.ghosts = sources.ghosts->at(request.now, [&request](std::uint64_t client) {
      return linear_rgb(user_colour(client, request.colours));
    });
  }
  if (request.surroundings == Surroundings::workplace) {
    add_hud(request, status, measure, frame);
  }
  return frame;
}

}  // namespace handloft::client
