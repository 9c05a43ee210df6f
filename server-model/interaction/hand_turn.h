#pragma once
// How a hand has turned since a moment: the rotation that best takes the fingertips of then to those of now,
// both about their means (Kabsch 1976, in Umeyama's form, 1991).

#include <Eigen/Geometry>
#include <array>
#include <optional>

#include "server-model/interaction/hand_sample.h"

namespace handloft::interaction {

using FingertipPositions = std::array<std::optional<Eigen::Vector3d>, finger_count>;

FingertipPositions fingertip_positions(const HandSample& sample);

/// By the fingers that both have. nullopt with fewer than three of them, or when they lie so nearly on a line
/// that the turn about it is noise.
std::optional<Eigen::Quaterniond> hand_turn(const FingertipPositions& then, const FingertipPositions& now);

}  // namespace handloft::interaction
