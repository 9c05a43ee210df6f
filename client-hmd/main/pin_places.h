#pragma once
// Where the pins of comments are shown (U6). The server knows places in space: one that was pinned without a
// place lies in the middle of its shape's box, within the shape, and one on a surface that has been pushed or
// fitted anew lies where the surface was. Shown are they on what is to be seen of their shape:
//
//  - near it, at its nearest place, so that they follow a surface that yields;
//  - farther within its box, where a vertical line through them leaves the shape at the top;
//  - beyond, where they are.
//
// A mesh is searched once for each state of it, and only so many vertices a frame: until it is its turn, a
// pin stays where it was shown last.

#include <cstddef>
#include <map>
#include <memory>
#include <string>

#include <glm/glm.hpp>

#include "client-hmd/mirror/scene.h"

namespace handloft::client {

struct PinPlacesOptions {
  /// Vertices and points looked at a frame: about a millisecond.
  std::size_t most_a_frame = 500'000;
  /// As near as this share of its box's diagonal a pin means the surface: more than a push of a hand moves
  /// it.
  float near_share = 0.25F;
};

/// Where a pin at `place` is shown that is pinned to `entity`. O(vertices + points). Pure.
glm::vec3 shown_pin_place(const Entity& entity, const glm::vec3& place, const PinPlacesOptions& options = {});

class PinPlaces {
 public:
  explicit PinPlaces(const PinPlacesOptions& options = {}) : options_(options) {}

  /// Once a frame.
  void follow(const Scene& scene);
  /// As of the last follow(); where the comment says when it is not known yet.
  glm::vec3 place_of(const PinnedComment& comment) const;

 private:
  struct Known {
    std::shared_ptr<const Entity> entity;  ///< For which `shown` was found; null: not yet.
    glm::vec3 told{0.0F};                  ///< The comment's own.
    glm::vec3 shown{0.0F};
  };
  PinPlacesOptions options_;
  std::map<std::string, Known> known_;  ///< By the comment's id.
};

}  // namespace handloft::client
