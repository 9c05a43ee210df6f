#include "client-hmd/render/curvature_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace handloft::client {
namespace {

/// 1 km: flatter than anything is made.
constexpr float flat_per_m = 1e-3F;

// sRGB, as the HUD's.
constexpr glm::vec4 paper{0.985F, 0.985F, 0.99F, 0.80F};
constexpr glm::vec4 ink{0.11F, 0.14F, 0.19F, 1.0F};
constexpr glm::vec4 faint_ink{0.36F, 0.40F, 0.46F, 1.0F};

glm::vec3 oklab_from_linear(const glm::vec3& c) {
  const glm::vec3 cone(std::cbrt(0.4122214708F * c.x + 0.5363325363F * c.y + 0.0514459929F * c.z),
                       std::cbrt(0.2119034982F * c.x + 0.6806995451F * c.y + 0.1073969566F * c.z),
                       std::cbrt(0.0883024619F * c.x + 0.2817188376F * c.y + 0.6299787005F * c.z));
  return {0.2104542553F * cone.x + 0.7936177850F * cone.y - 0.0040720468F * cone.z,
          1.9779984951F * cone.x - 2.4285922050F * cone.y + 0.4505937099F * cone.z,
          0.0259040371F * cone.x + 0.7827717662F * cone.y - 0.8086757660F * cone.z};
}

glm::vec3 linear_from_oklab(const glm::vec3& lab) {
  const float l = lab.x + 0.3963377774F * lab.y + 0.2158037573F * lab.z;
  const float m = lab.x - 0.1055613458F * lab.y - 0.0638541728F * lab.z;
  const float s = lab.x - 0.0894841775F * lab.y - 1.2914855480F * lab.z;
  const glm::vec3 cone(l * l * l, m * m * m, s * s * s);
  return glm::clamp(glm::vec3(4.0767416621F * cone.x - 3.3077115913F * cone.y + 0.2309699292F * cone.z,
                              -1.2684380046F * cone.x + 2.6097574011F * cone.y - 0.3413193965F * cone.z,
                              -0.0041960863F * cone.x - 0.7034186147F * cone.y + 1.7076147010F * cone.z),
                    0.0F, 1.0F);
}

glm::vec4 encoded(const glm::vec3& linear) {
  glm::vec4 srgb(1.0F);
  for (int i = 0; i < 3; ++i) {
    const float c = linear[i];
    srgb[i] = c <= 0.0031308F ? 12.92F * c : 1.055F * std::pow(c, 1.0F / 2.4F) - 0.055F;
  }
  return srgb;
}

std::string title_of(CurvatureKind kind) {
  for (const NamedChoice<CurvatureKind>& known : curvature_kinds()) {
    if (known.choice == kind) return std::string(known.words);
  }
  return {};
}

}  // namespace

glm::vec3 curvature_colour(const DivergingRamp& ramp, float share) {
  const glm::vec3 nought = linear_rgb(ramp.nought);
  if (std::isnan(share)) return nought;
  const float at = std::clamp(share, -1.0F, 1.0F);
  const glm::vec3 end = linear_rgb(at < 0.0F ? ramp.negative : ramp.positive);
  return linear_from_oklab(glm::mix(oklab_from_linear(nought), oklab_from_linear(end), std::abs(at)));
}

std::string radius_words(float curvature_per_m) {
  if (!(std::abs(curvature_per_m) >= flat_per_m)) return "flat";
  const float radius_m = 1.0F / std::abs(curvature_per_m);
  const char* sign = curvature_per_m < 0.0F ? "−" : "";
  return radius_m < 1.0F ? fmt::format("{}R {:.3g} mm", sign, 1e3F * radius_m)
                         : fmt::format("{}R {:.3g} m", sign, radius_m);
}

void add_curvature_legend(CurvatureKind kind, float range_per_m, const DivergingRamp& ramp, int width_px,
                          int height_px, Overlay& overlay) {
  constexpr int steps = 40;
  constexpr std::array<float, 5> marks{1.0F, 0.5F, 0.0F, -0.5F, -1.0F};
  const float text = std::clamp(static_cast<float>(height_px) / 45.0F, 10.0F, 40.0F);
  const float bar_height = 10.0F * text, bar_width = 1.1F * text, padding = 0.9F * text;
  const glm::vec2 size(13.2F * text, bar_height + 3.6F * text);
  const glm::vec2 corner(static_cast<float>(width_px) - size.x - 1.1F * text,
                         0.5F * (static_cast<float>(height_px) - size.y));
  overlay.panels.push_back({corner, size, 0.9F * text, paper});
  overlay.texts.push_back(
      {title_of(kind), corner + glm::vec2(padding, padding + 0.8F * text), text, faint_ink, TextAlign::left});
  const glm::vec2 top = corner + glm::vec2(padding, padding + 1.7F * text);
  for (int i = 0; i < steps; ++i) {
    const float share = 1.0F - 2.0F * (static_cast<float>(i) + 0.5F) / steps;
    const float y = bar_height * static_cast<float>(i) / steps;
    // A little over its neighbour, so that no seam is seen between them.
    overlay.panels.push_back({top + glm::vec2(0.0F, y),
                              {bar_width, bar_height / steps + 0.5F},
                              0.0F,
                              encoded(curvature_colour(ramp, share))});
  }
  for (const float mark : marks) {
    const float y = 0.5F * (1.0F - mark) * bar_height;
    overlay.texts.push_back(
        {fmt::format("{:+.3g}/m  {}", mark * range_per_m, radius_words(mark * range_per_m)),
         top + glm::vec2(bar_width + 0.6F * text, y + 0.36F * text), 0.85F * text, ink, TextAlign::left});
  }
}

}  // namespace handloft::client
