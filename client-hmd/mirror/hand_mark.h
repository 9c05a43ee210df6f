#pragma once
// Where somebody's fingertips and head are, as presence tells (U1), checked. Metres, world frame.

#include <array>
#include <cstddef>

#include "client-hmd/mirror/scene.h"

namespace handloft::client {

/// How sure a fingertip's place is (T6).
enum class TipState { lost, predicted, seen };

struct TipMark {
  TipState state = TipState::lost;  ///< When lost, the rest means nothing.
  Vec3f place;
  Vec3f velocity;  ///< m/s
};

/// What hands do as a whole, which decides how the fingers are bent.
enum class HandPosture { open, closed, pointing, on_table };

inline constexpr std::size_t tips_of_a_hand = 5;

struct HandMark {
  std::array<TipMark, tips_of_a_hand> tips;  ///< Thumb to little finger.
  HandPosture posture = HandPosture::open;
  float pressure = 0.0F;  ///< 0..1
  bool pressing = false;
};

/// A head: x right, y up, z backwards.
struct HeadMark {
  Vec3f place;
  std::array<float, 4> orientation{1.0F, 0.0F, 0.0F, 0.0F};  ///< w, x, y, z; unit.
  Vec3f velocity;                                            ///< m/s
  Vec3f angular_velocity;                                    ///< rad/s, world
};

}  // namespace handloft::client
