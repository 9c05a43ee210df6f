#pragma once
// The head-up display (V7): what the connection, the hand and the model are doing, in few words at the edges
// of the picture. Pure: a status in, panels and texts out.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client-hmd/mirror/model_feed.h"
#include "client-hmd/render/frame.h"
#include "client-hmd/view/tracking_feed.h"

namespace handloft::client {

struct HudStatus {
  bool model_connected = false;
  bool has_scene = false;  ///< A snapshot was received.
  bool tracking_wanted = false;
  bool tracking_connected = false;
  std::optional<Duration> lag;       ///< How far the model is behind the hand; shown from lag_threshold on.
  std::optional<double> latency_ms;  ///< Capture to client, median.
  std::optional<HandStatus> hand;
  std::string tool;  ///< What the hand does, in words of the server.
  bool symmetry = false;
  std::string mode;                      ///< What a pointing hand draws: "profile", "boundary".
  std::optional<float> range;            ///< Of a push, 0..1 (A16); while there is a disk.
  bool smooth_falloff = false;           ///< Of the push (A17).
  std::vector<std::string> others;       ///< Who else is here ...
  std::vector<std::uint64_t> other_ids;  ///< ... and as which client, for the colour.
  std::size_t shapes = 0, surfaces = 0, points = 0;
  std::size_t references = 0;  ///< Imported, to design around (A28).
  ColourScheme colours = ColourScheme::normal;
  std::optional<DistanceScale> distances;  ///< Shown: with a legend.
  std::size_t compared = 0;                ///< Shapes whose distances are known.
  Alternatives alternatives;               ///< Told when there is more than one.
  std::string selected;                    ///< Name of the shape that gestures act on.
  std::optional<Representation> representation;
  std::string target;     ///< Name of what the hand would act on, where that is not what is selected.
  std::size_t icons = 0;  ///< On sculpted surfaces (D17).
  std::string icon;       ///< The one that is held or, if none is, aimed at.
  bool icon_held = false;
  History history;
};

/// From here on a lag is shown (V5).
inline constexpr Duration lag_threshold = std::chrono::milliseconds(250);

/// How far the model's picture is behind the hand's: between the newest capture that tracking reports and the
/// newest that shaped what the server sent; nullopt while nothing moves or the server says nothing of
/// captures.
std::optional<Duration> model_lag(const TrackingStatus& tracking, const ModelState& model, TimePoint now);

/// "open hand", "closed hand", "pointing", "hand on table"; "no hand" for unknown.
std::string_view gesture_words(v1::Gesture gesture);

/// Where the HUD's words are. Beside panels only legends are left to tell; a headset does not show the
/// picture's edges.
enum class HudPlace { edges, legends, table };

/// Only what the colours mean, in the upper right corner of a part of the picture. Pixels.
Overlay layout_legends(const HudStatus& status, const glm::vec2& corner_px, const glm::vec2& size_px,
                       const std::function<float(std::string_view)>& measure);

/// `measure`: width of a text in multiples of its height. Sizes follow the picture's height, so that the
/// words are as large in a headset as on a desk.
Overlay layout_hud(const HudStatus& status, int width_px, int height_px,
                   const std::function<float(std::string_view)>& measure);

}  // namespace handloft::client
