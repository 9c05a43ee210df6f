#pragma once
// The five fingertips of a HandState: flat lists on the wire (most of a tracking frame's bytes, and read
// several times faster than a message a fingertip), one record each in memory.

#include <array>
#include <cstdint>

#include "common/base/result.h"
#include "proto/tracking.pb.h"

namespace handloft::codec {

inline constexpr std::size_t fingertip_count = 5;

struct FingertipRecord {
  v1::TrackingState state = v1::TRACKING_LOST;  ///< When lost, the rest means nothing.
  std::array<double, 3> position_m{};           ///< World; may be NaN when it comes from outside.
  std::array<float, 3> velocity_m_s{};
  std::array<float, 6> covariance_m2{};  ///< Upper triangle row by row: xx, xy, xz, yy, yz, zz.
  std::uint32_t camera_mask = 0;         ///< Bit i: seen by camera i within the last 100 ms.
};
/// In the order of v1::Finger: thumb to little finger.
using Fingertips = std::array<FingertipRecord, fingertip_count>;

/// Replaces the hand's fingertips. What is lost is written as zeros.
void pack_fingertips(const Fingertips& tips, v1::HandState& hand);

/// A hand without states has all fingertips lost. Velocities, covariances and masks may be left out as a
/// whole (zeros then). invalid_argument when a list has another length than five times its width; the field
/// is the list's name, "fingertip_positions". Numbers are passed on as they are: who uses them checks them.
Result<Fingertips> unpack_fingertips(const v1::HandState& hand);

}  // namespace handloft::codec
