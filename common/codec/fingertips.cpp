#include "common/codec/fingertips.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

namespace handloft::codec {
namespace {

template <typename List>
Status check_length(const List& list, std::size_t width, bool required, const char* field) {
  const auto found = static_cast<std::size_t>(list.size());
  if (found == fingertip_count * width || (found == 0 && !required)) return {};
  return make_error(ErrorCode::invalid_argument,
                    fmt::format("found {} numbers, expected {}", found, fingertip_count * width), field);
}

template <typename List, typename Number, std::size_t width>
void read(const List& list, std::size_t tip, std::array<Number, width>& to) {
  if (list.empty()) return;
  const auto* from = list.data() + tip * width;
  std::copy(from, from + width, to.begin());
}

template <typename Number, std::size_t width>
void write(const std::array<Number, width>& from, bool lost, google::protobuf::RepeatedField<Number>& to) {
  for (const Number value : from) to.Add(lost ? Number{0} : value);
}

}  // namespace

void pack_fingertips(const Fingertips& tips, v1::HandState& hand) {
  hand.clear_fingertip_states();
  hand.clear_fingertip_positions();
  hand.clear_fingertip_velocities();
  hand.clear_fingertip_covariances();
  hand.clear_fingertip_camera_masks();
  for (const FingertipRecord& tip : tips) {
    const bool lost = tip.state == v1::TRACKING_LOST;
    hand.add_fingertip_states(tip.state);
    write(tip.position_m, lost, *hand.mutable_fingertip_positions());
    write(tip.velocity_m_s, lost, *hand.mutable_fingertip_velocities());
    write(tip.covariance_m2, lost, *hand.mutable_fingertip_covariances());
    hand.add_fingertip_camera_masks(tip.camera_mask);
  }
}

Result<Fingertips> unpack_fingertips(const v1::HandState& hand) {
  Fingertips tips;
  if (hand.fingertip_states().empty()) return tips;
  for (const Status& status :
       {check_length(hand.fingertip_states(), 1, true, "fingertip_states"),
        check_length(hand.fingertip_positions(), 3, true, "fingertip_positions"),
        check_length(hand.fingertip_velocities(), 3, false, "fingertip_velocities"),
        check_length(hand.fingertip_covariances(), 6, false, "fingertip_covariances"),
        check_length(hand.fingertip_camera_masks(), 1, false, "fingertip_camera_masks")}) {
    if (!status) return status.error();
  }
  for (std::size_t i = 0; i < tips.size(); ++i) {
    const auto index = static_cast<int>(i);
    tips[i].state = hand.fingertip_states(index);
    read(hand.fingertip_positions(), i, tips[i].position_m);
    read(hand.fingertip_velocities(), i, tips[i].velocity_m_s);
    read(hand.fingertip_covariances(), i, tips[i].covariance_m2);
    if (!hand.fingertip_camera_masks().empty()) tips[i].camera_mask = hand.fingertip_camera_masks(index);
  }
  return tips;
}

}  // namespace handloft::codec
