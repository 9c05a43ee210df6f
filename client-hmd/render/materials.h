#pragma once
// What shapes are made of, to look at: each its own of a few quiet colours that go together, so that
// adjoining ones are told apart without shouting. Pure.

#include <cstdint>
#include <glm/glm.hpp>
#include <map>
#include <string>
#include <string_view>

namespace handloft::client {

/// Linear RGB.
struct ShapeColour {
  glm::vec3 shell{0.5F};  ///< Of its surface.
  glm::vec3 ink{0.0F};    ///< Of its points: deep, to be read on the shell and on the table.
};

/// A shape keeps its colour for as long as it is there; a new one gets the one that is used least. A shape
/// and its mirror image ("side", "side-mirror") have the same.
class ShapeColours {
 public:
  ShapeColour of(std::string_view id);
  /// Frees those of shapes for which `keep(id)` is false.
  template <typename Keep>
  void keep_only(const Keep& keep) {
    std::erase_if(taken_, [&keep](const auto& item) { return !keep(item.first); });
  }

 private:
  std::map<std::string, std::size_t, std::less<>> taken_;  ///< By the name without "-mirror".
};

/// "side-mirror" is the mirror image of "side".
std::string_view without_mirror(std::string_view id);

}  // namespace handloft::client
