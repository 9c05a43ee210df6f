#pragma once
// How different colours look, and to whom: the simulation of missing cones (Machado, Oliveira and Fernandes,
// "A Physiologically-based Model for Simulation of Color Vision Deficiency", TVCG 2009, severity 1), the
// colour difference CIEDE2000 (Sharma, Wu and Dalal 2005) and the contrast of text (WCAG 2.1, 1.4.3). Linear
// RGB of sRGB's primaries, white D65.

#include <array>
#include <cstdint>
#include <glm/glm.hpp>

namespace handloft::client {

enum class Sight { normal, protanopia, deuteranopia, tritanopia };

inline constexpr std::array all_sights{Sight::normal, Sight::protanopia, Sight::deuteranopia,
                                       Sight::tritanopia};

/// What somebody with that sight sees, as normal sight sees it; linear RGB within 0..1.
glm::dvec3 seen_by(Sight sight, const glm::dvec3& linear_rgb);

/// CIE L*, a*, b* of linear RGB.
glm::dvec3 cielab(const glm::dvec3& linear_rgb);

/// CIEDE2000 of two CIELAB colours with unit weights; 0: equal, about 1: just noticeable, 100: black to
/// white.
double colour_difference(const glm::dvec3& lab_a, const glm::dvec3& lab_b);

/// The same for colours as 0x00RRGGBB as `sight` sees them.
double colour_difference(std::uint32_t a, std::uint32_t b, Sight sight);

/// WCAG's (L1 + 0.05) / (L2 + 0.05) of two opaque colours as 0x00RRGGBB: 1..21; text wants 4.5.
double contrast_ratio(std::uint32_t a, std::uint32_t b);

}  // namespace handloft::client
