#pragma once
// The status card of a headset (V7): what the HUD says at a picture's edges, where a headset shows nothing,
// stands as a card on the table behind the palette, tilted towards the designer: connections, gesture and
// tool, pressure and range, what is selected, who is here. Pure: a status in, a sheet in space out.

#include <functional>
#include <string_view>

#include "client-hmd/hud/hud.h"
#include "client-hmd/render/colours.h"
#include "client-hmd/render/frame.h"

namespace handloft::client {

/// Metres and radians, world frame.
struct TableCardPlace {
  glm::vec3 lower_left{-0.165F, 0.125F, 0.004F};  ///< Behind the palette's blocks, clear of the table.
  float width_m = 0.41F;                          ///< From one block's outer edge to the other's.
  float tilt_rad = 0.90F;  ///< From the table: across the line of sight of who sits before it.
  float text_m = 0.0115F;  ///< Height of the text: capitals have 0.73 of it.
};

/// Where and how large it is for an eye of that focal length in pixels: a wide view has few pixels for a
/// letter, so the card and above all its words are larger there. Capitals keep 12 pixels (V7) down to 470.
/// What is no sensible number is taken for a long one.
TableCardPlace table_card_place(double focal_px);

SpaceSheet table_card(const HudStatus& status, ColourScheme colours,
                      const std::function<float(std::string_view)>& measure,
                      const TableCardPlace& place = {});

}  // namespace handloft::client
