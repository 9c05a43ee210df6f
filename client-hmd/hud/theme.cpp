#include "client-hmd/hud/theme.h"

namespace handloft::client {
namespace {

constexpr Theme normal_theme{
    .ground = 0xFBFBFC,
    .raised = 0xF0F2F5,
    .hovered = 0xE3E8EF,
    .line = 0xD5DAE1,
    .ink = 0x1B222D,
    .faint_ink = 0x525C6A,
    .disabled_ink = 0x5F6874,
    .accent = 0x1F5FBF,
    .accent_hovered = 0x194FA0,
    .on_accent = 0xFFFFFF,
    .chosen = 0xDFE9F8,
    .good_ink = 0x0B6B3E,
    .caution_ink = 0x8A4B00,
    .bad_ink = 0xA81C26,
    .ground_opacity = 0.975F,
};

constexpr Theme safe_theme{
    .ground = 0xFBFBFC,
    .raised = 0xF0F2F5,
    .hovered = 0xE3E8EF,
    .line = 0xD5DAE1,
    .ink = 0x1B222D,
    .faint_ink = 0x525C6A,
    .disabled_ink = 0x5F6874,
    .accent = 0x00609A,
    .accent_hovered = 0x004E7E,
    .on_accent = 0xFFFFFF,
    .chosen = 0xDCEBF7,
    .good_ink = 0x00645C,
    .caution_ink = 0x7D4F00,
    .bad_ink = 0x8E1B10,
    .ground_opacity = 0.975F,
};

constexpr Theme contrast_theme{
    .ground = 0x000000,
    .raised = 0x16181C,
    .hovered = 0x30353D,
    .line = 0x9AA3AF,
    .ink = 0xFFFFFF,
    .faint_ink = 0xE2E6EC,
    .disabled_ink = 0xB4BBC6,
    .accent = 0xFFD23F,
    .accent_hovered = 0xFFE48A,
    .on_accent = 0x000000,
    .chosen = 0x1D2F4D,
    .good_ink = 0x7DF0C0,
    .caution_ink = 0xFFD23F,
    .bad_ink = 0xFFA59B,
    .ground_opacity = 1.0F,
};

}  // namespace

const Theme& theme(ColourScheme scheme) {
  switch (scheme) {
    case ColourScheme::colour_blind_safe:
      return safe_theme;
    case ColourScheme::high_contrast:
      return contrast_theme;
    case ColourScheme::normal:
      break;
  }
  return normal_theme;
}

}  // namespace handloft::client
