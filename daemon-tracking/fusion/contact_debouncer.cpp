#include "daemon-tracking/fusion/contact_debouncer.h"

#include <algorithm>

namespace handloft::tracking {

void ContactDebouncer::feed(TimePoint time, std::uint8_t raw_bits) {
  advance(time);
  for (std::size_t i = 0; i < pads_.size(); ++i) {
    Pad& pad = pads_[i];
    const bool raw = (raw_bits >> i & 1u) != 0;
    if (raw == pad.raw) continue;
    const TimePoint rested_since = pad.stable_since;
    pad.raw = raw;
    pad.stable_since = now_;
    const bool debounced = (bits_ >> i & 1u) != 0;
    if (raw != debounced) {
      // A run of edges goes on while the pad does not rest at its old state for as long as a change needs.
      const Duration rest = debounced ? options_.release : options_.press;
      if (!pad.edge_seen || now_ - rested_since > rest) pad.first_edge = now_;
      pad.edge_seen = true;
      pad.pending = true;
    } else {
      ++bounces_;
      pad.pending = false;
    }
  }
}

void ContactDebouncer::advance(TimePoint time) {
  now_ = started_ ? std::max(now_, time) : time;
  started_ = true;
  for (std::size_t i = 0; i < pads_.size(); ++i) {
    Pad& pad = pads_[i];
    if (!pad.pending) continue;
    if (now_ - pad.stable_since < (pad.raw ? options_.press : options_.release)) continue;
    bits_ = static_cast<std::uint8_t>(pad.raw ? bits_ | (1u << i) : bits_ & ~(1u << i));
    pad.changed = pad.first_edge;
    pad.edge_seen = false;
    pad.pending = false;
  }
}

void ContactDebouncer::release_all(TimePoint time) {
  now_ = started_ ? std::max(now_, time) : time;
  started_ = true;
  for (std::size_t i = 0; i < pads_.size(); ++i) {
    if ((bits_ >> i & 1u) != 0) pads_[i].changed = now_;
    pads_[i].raw = pads_[i].pending = false;
    pads_[i].edge_seen = false;
  }
  bits_ = 0;
}

}  // namespace handloft::tracking
