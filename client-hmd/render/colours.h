#pragma once
// What is drawn in which colour (V7): fingers, people, states and ramps, in three schemes, so that every pass
// and the HUD take them from one table. Colours are sRGB as 0x00RRGGBB (IEC 61966-2-1), as the daemon tells
// those of fingertips.
//
// "colour_blind_safe" starts from Okabe and Ito, "Color Universal Design" (2008), moved apart until whatever
// must be told apart differs by smallest_safe_difference (CIEDE2000) to people with normal sight and to those
// without red, green or blue cones (colour_vision.h). Even so, nothing is told by colour alone.

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <string_view>

namespace handloft::client {

enum class ColourScheme { normal, colour_blind_safe, high_contrast };

inline constexpr std::array colour_schemes{ColourScheme::normal, ColourScheme::colour_blind_safe,
                                           ColourScheme::high_contrast};

/// "normal", "colour-blind-safe", "high-contrast": in options and files.
std::string_view colour_scheme_name(ColourScheme scheme);
std::optional<ColourScheme> colour_scheme_from(std::string_view name);

/// For signed quantities: light in the middle, another hue and darker towards either end.
struct DivergingRamp {
  std::uint32_t negative = 0, nought = 0, positive = 0;
};

struct SceneColours {
  std::array<std::uint32_t, 5> fingers{};   ///< Thumb to little finger, where no cap's colour is told.
  std::array<std::uint32_t, 7> users{};     ///< By client; user_colour() takes turns.
  std::uint32_t pressing = 0, resting = 0;  ///< A gauge while a hand lays points, and else.
  std::uint32_t profile = 0, boundary = 0, curve = 0;  ///< Strokes in the air and on shapes.
  std::uint32_t selected = 0, target = 0;              ///< What gestures act on; what the hand would.
  std::uint32_t symmetry = 0;                          ///< The plane of symmetry.
  std::uint32_t control_net = 0, control_point = 0;    ///< Over a surface.
  std::uint32_t good = 0, caution = 0, bad = 0;        ///< States, beside a sign or a word.
  DivergingRamp distance;                              ///< Below and above a reference (A28).
  DivergingRamp curvature;                             ///< Saddle, flat, bowl.
};

/// The table of a scheme.
const SceneColours& scene_colours(ColourScheme scheme);

/// Whoever has that id; the own hand has the same colour as others see it in.
std::uint32_t user_colour(std::uint64_t client_id, ColourScheme scheme);

/// For what goes into the lit picture: linear RGB.
glm::vec3 linear_rgb(std::uint32_t srgb);
/// For what is drawn after the encoding: sRGB and opacity, not premultiplied.
glm::vec4 overlay_rgba(std::uint32_t srgb, float opacity = 1.0F);

/// Linear RGB at `share` of the range, -1..1; beyond, and for NaN, as at the ends and nought. As
/// distance_colour().
glm::vec3 ramp_colour(const DivergingRamp& ramp, float share);

/// What the two schemes for it keep between colours that must be told apart, under every deficiency; two
/// patches side by side are different at 2.3.
inline constexpr double smallest_safe_difference = 15.0;

}  // namespace handloft::client
