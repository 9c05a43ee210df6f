#pragma once
// The prediction of fused states (T8): the one formula of common/base/motion_prediction.h applied to tips and
// heads, with the covariance that grows with it.

#include "common/base/motion_prediction.h"
#include "daemon-tracking/fusion/fused_state.h"

namespace handloft::tracking {

/// `tip` carried `ahead_s` beyond its time. Its state is left to whoever knows when it was last seen.
FusedTip predict(const FusedTip& tip, double ahead_s, const PredictionLimits& limits = {});
FusedHead predict(const FusedHead& head, double ahead_s, const PredictionLimits& limits = {});

}  // namespace handloft::tracking
