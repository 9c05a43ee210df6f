#pragma once
// How far the live state is from the simulated truth at the same capture time: the figures of the report. The
// truth only ever comes here, never into the pipeline.

#include <array>
#include <cstdint>
#include <deque>

#include "daemon-tracking/fusion/fused_state.h"
#include "daemon-tracking/source/sample.h"

namespace handloft::tracking {

/// Root mean square and largest magnitude of an error.
struct ErrorSummary {
  std::uint64_t count = 0;
  double sum_of_squares = 0.0;
  double largest = 0.0;

  void add(double error);
  double rms() const;
};

struct Accuracy {
  /// Of every fingertip that the state gave (tracked, single or predicted), in metres.
  ErrorSummary fingertips_m;
  std::array<ErrorSummary, finger_count> by_finger_m;
  std::uint64_t fingertips_lost = 0;  ///< The truth had one, the state none.
  ErrorSummary head_position_m;
  ErrorSummary head_rotation_rad;
  std::uint64_t heads_lost = 0;
  std::uint64_t compared = 0;  ///< States for which the truth of the same instant was known.
};

class AccuracyMeter {
 public:
  void add(const Truth& truth);
  /// Compares with the truth of exactly the state's time, if there is one.
  void add(const FusedState& state);
  const Accuracy& accuracy() const { return accuracy_; }

 private:
  static constexpr std::size_t remembered_truths = 256;  // Some seconds of three cameras.
  std::deque<Truth> truths_;
  Accuracy accuracy_;
};

}  // namespace handloft::tracking
