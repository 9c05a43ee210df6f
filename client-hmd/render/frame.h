#pragma once
// All that one picture shows, as a value: what the renderer is given for every frame. World frame, metres.

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client-hmd/mirror/control_net.h"
#include "client-hmd/mirror/scene.h"
#include "client-hmd/render/colours.h"
#include "client-hmd/render/cursor_mark.h"
#include "client-hmd/render/distance_map.h"
#include "client-hmd/render/hand_shape.h"
#include "client-hmd/render/image.h"
#include "client-hmd/render/look.h"
#include "client-hmd/view/pinhole.h"
#include "common/base/clock.h"
#include "common/base/table_palette.h"

namespace handloft::client {

/// A filmed picture and the camera that took it (its pose is the Eye's).
struct FilmedPicture {
  std::shared_ptr<const Image> image;
  std::uint64_t serial = 0;  ///< Another number: another picture, to be uploaded again.
  Pinhole camera;            ///< With distortion.
  /// Homogeneous, y down: direction in the camera's frame from direction in the eye's. The identity where the
  /// eye is the camera; for an eye beside it see film_seen_from() (view/stereo.h).
  glm::mat3 camera_from_eye{1.0F};
};

/// The head through whose eyes a frame is seen: what the last turn to the display time needs (V1).
struct HeadView {
  TimePoint time;             ///< When everything is where it is drawn.
  RigidPose world_from_head;  ///< At that time.
};

/// One fingertip of the cursor.
struct FingerMark {
  glm::vec3 position{0.0F};
  glm::vec3 colour{1.0F};  ///< Linear RGB.
  float opacity = 1.0F;    ///< Below 1: predicted, not seen.
};

/// Where the next point would be laid, and with what certainty.
struct PressureMark {
  glm::vec3 centre{0.0F};
  float pressure = 0.0F;  ///< 0..1
  bool pressing = false;
};

/// New strokes are mirrored at this plane (A12).
struct SymmetryHint {
  glm::vec3 origin{0.0F};
  glm::vec3 normal{1.0F, 0.0F, 0.0F};  ///< Unit.
};

/// The modification disk of a closed hand (A13), and how far its push will reach (A16).
struct DiskHint {
  glm::vec3 centre{0.0F};
  glm::vec3 normal{0.0F, 0.0F, 1.0F};  ///< Unit: the direction of pushing.
  float radius_m = 0.0F;
  float range = 0.0F;                            ///< 0..1
  std::optional<glm::vec3> tint = std::nullopt;  ///< Another user's colour, linear RGB; none: our own hand's.
};

/// A rounded rectangle in output pixels, origin top left.
struct OverlayPanel {
  glm::vec2 position{0.0F};
  glm::vec2 size{0.0F};
  float radius_px = 8.0F;
  glm::vec4 fill{0.0F};  ///< sRGB and opacity, not premultiplied.
};

enum class TextAlign { left, centre, right };

/// A line of text in output pixels; `position` is on the baseline.
struct OverlayText {
  std::string text;  ///< UTF-8
  glm::vec2 position{0.0F};
  float height_px = 16.0F;
  glm::vec4 colour{1.0F};
  TextAlign align = TextAlign::left;
};

/// Drawn last, panels before texts.
struct Overlay {
  std::vector<OverlayPanel> panels;
  std::vector<OverlayText> texts;
};

/// Another user: where hand and head are, in that user's colour, and in words what the hand does (U1).
struct GhostHint {
  std::uint64_t client_id = 0;
  std::string name;
  std::string doing;       ///< "laying points"; empty: nothing.
  std::string entity;      ///< Id of what it is done to; framed in the user's colour. Empty: none.
  glm::vec3 colour{0.5F};  ///< Linear RGB.
  float opacity = 1.0F;    ///< Falls when nothing more is heard.
  HandTips tips;
  HandPosture posture = HandPosture::open;
  std::optional<RigidPose> head;  ///< OpenGL axes.
  std::optional<DiskHint> disk;
  std::shared_ptr<const SceneCurve> curve;  ///< Being drawn; null: none.
};

/// Whose a shape is for some seconds (U1): framed in that user's colour, with the name over it.
struct HolderMark {
  std::string entity;  ///< Id
  std::string name;
  glm::vec3 colour{0.5F};  ///< Linear RGB.
};

/// A comment's place, with its number as in the panels (U6).
struct PinMark {
  glm::vec3 place{0.0F};
  int number = 1;
  glm::vec3 colour{0.5F};  ///< Whose it is; linear RGB.
};

/// Whether the filmed hand hides what is virtual and behind it.
enum class HandOcclusion { off, on };

/// The hand that the film shows.
struct FilmedHand {
  HandTips tips;
  HandPosture posture = HandPosture::open;
};

/// A flat drawing that stands or lies in the room: `overlay` in metres from `origin`, as linear RGB.
struct SpaceSheet {
  glm::vec3 origin{0.0F};
  glm::vec3 right{1.0F, 0.0F, 0.0F};  ///< Unit.
  glm::vec3 down{0.0F, -1.0F, 0.0F};  ///< Unit.
  Overlay overlay;
};

struct Frame {
  std::shared_ptr<const Scene> scene;  ///< Null: an empty one.
  Eye eye;
  std::optional<FilmedPicture> film;
  std::vector<FingerMark> fingers;
  std::optional<PressureMark> pressure;
  std::optional<CursorMark> cursor;  ///< Of the desktop's hand.
  std::optional<SymmetryHint> symmetry;
  std::vector<DiskHint> disks;                                ///< One a closed hand.
  std::vector<std::shared_ptr<const SceneCurve>> air_curves;  ///< Being drawn; never null.
  int palette_page = first_palette_page;        ///< Whose cells the table shows; 0: none at all.
  std::vector<SpaceSheet> sheets;               ///< Status cards and the like.
  std::optional<PaletteCommand> touched;        ///< The palette's cell under the hand.
  std::optional<DistanceScale> distances;       ///< Shapes show theirs (A28); references fade.
  ColourScheme colours = ColourScheme::normal;  ///< Of what is selected, of ramps, nets and strokes (V7).
  Shading shading = Shading::studio;
  CurvatureView curvature;   ///< Which, where `shading` shows it.
  SurfaceOverlays overlays;  ///< Lines over surfaces.
  ControlNets control_nets;  ///< Of the entities that have one, as far as it is known.
  SurfaceEdges edges = SurfaceEdges::soft;
  Surroundings surroundings = Surroundings::workplace;
  std::optional<glm::vec3> plain_backdrop;  ///< Linear RGB instead of backdrop, film and table: for mattes.
  std::vector<GhostHint> ghosts;
  std::vector<HolderMark> holders;
  std::vector<PinMark> pins;
  std::optional<FilmedHand> filmed_hand;  ///< With film: where our own hand is in it.
  HandOcclusion hand_occlusion = HandOcclusion::on;
  Overlay overlay;
  std::optional<HeadView> head;  ///< None: the orbiting camera looks.
  /// Drawn beyond what is shown, on each side, so that the last turn has something to show: the eye's pinhole
  /// has it, the overlay does not.
  int margin_px = 0;
};

}  // namespace handloft::client
