#pragma once
// What somebody's hand does (Presence in scene.proto), checked: words for the HUD, and what hangs in the air
// while it works: the modification disk (A13), the stroke being drawn (A18, A24), the plane of symmetry
// (A12), and where its fingertips and its owner's head are, for the ghosts that others see (U1). It may come
// from anybody: a message with one bad number is refused whole. Metres, world frame.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "client-hmd/mirror/hand_mark.h"
#include "client-hmd/mirror/scene.h"
#include "common/base/clock.h"
#include "common/base/result.h"
#include "proto/scene.pb.h"

namespace handloft::client {

struct DiskMark {
  Vec3f centre;
  Vec3f normal;  ///< Unit: the direction of pushing.
  float radius_m = 0.0F;
};

struct PlaneMark {
  Vec3f origin;
  Vec3f normal;  ///< Unit.
};

struct Activity {
  std::uint64_t client_id = 0;  ///< 0: a hand that tracking follows, nobody else.
  std::string name;             ///< With the client, tells hands apart: "hand", "hand 2".
  std::string tool;             ///< "laying points", "fit"; empty: nothing.
  std::string entity;           ///< On which entity.
  std::string mode;             ///< What a pointing hand draws: "profile", "boundary"; empty: not told.
  bool symmetry = false;        ///< New strokes are mirrored ...
  std::optional<PlaneMark> symmetry_plane;  ///< ... in this plane.
  std::optional<DiskMark> disk;             ///< While the hand is closed.
  bool smooth_falloff = false;              ///< Of pushes (A17); else the literal one.
  std::uint32_t palette_page = 0;           ///< That the table shows; 0: not told.
  float range = 0.0F;                       ///< Of the propagation, 0..1 (A16).
  std::shared_ptr<const SceneCurve> curve;  ///< Being drawn; null: none.
  std::optional<HandMark> hand;             ///< None when all fingertips are lost.
  std::optional<HeadMark> head;             ///< None when it is not tracked.
  TimePoint received_at;                    ///< Set by who receives it.
};

struct ActivityLimits {
  std::size_t max_text_bytes = 256;
  std::size_t max_curve_points = 100'000;  ///< Nearly an hour of drawing at 30 points a second.
  double max_coordinate_m = 1e4;
  double max_disk_radius_m = 1.0;  ///< A hand's disk is 60 mm at most (A13); a metre hides the scene.
  double max_speed_m_s = 1e3;      ///< A hand does 10 m/s; beyond this it is no measurement.
  double max_turn_rad_s = 1e3;
};

/// Texts are cut at the limit; everything else that is wrong is an error (data_corrupt, resource_exhausted)
/// that names the field.
Result<Activity> read_activity(const v1::Presence& presence, const ActivityLimits& limits = {});

}  // namespace handloft::client
