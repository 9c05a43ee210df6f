#include "client-hmd/render/materials.h"

#include <algorithm>
#include <array>

#include "client-hmd/render/colours.h"

namespace handloft::client {
namespace {

struct Lacquer {
  std::uint32_t shell = 0, ink = 0;  ///< sRGB
};

/// As a designer would mix them: silver, graphite, slate, cognac, sand, anthracite, sage, plum. Their inks
/// are deep enough to be read on them and on the table.
constexpr std::array<Lacquer, 8> lacquers{{{0xAEB8C2, 0x1D4273},
                                           {0x6A717B, 0x0D1116},
                                           {0x71869A, 0x12304D},
                                           {0xAD6A44, 0x4F1D0A},
                                           {0xC9BBA3, 0x5E4519},
                                           {0x56606C, 0x080D13},
                                           {0x8A9A86, 0x203A1E},
                                           {0x7C6573, 0x3A1B33}}};

constexpr std::string_view mirror_suffix = "-mirror";

}  // namespace

std::string_view without_mirror(std::string_view id) {
  if (id.ends_with(mirror_suffix) && id.size() > mirror_suffix.size()) id.remove_suffix(mirror_suffix.size());
  return id;
}

ShapeColour ShapeColours::of(std::string_view id) {
  const std::string_view name = without_mirror(id);
  auto found = taken_.find(name);
  if (found == taken_.end()) {
    std::array<std::size_t, lacquers.size()> uses{};
    for (const auto& [other, taken] : taken_) ++uses[taken];
    const auto least = std::min_element(uses.begin(), uses.end());
    found = taken_.emplace(std::string(name), static_cast<std::size_t>(least - uses.begin())).first;
  }
  const Lacquer& lacquer = lacquers[found->second];
  return {linear_rgb(lacquer.shell), linear_rgb(lacquer.ink)};
}

}  // namespace handloft::client
