#include "server-model/interaction/exponent_gesture.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace handloft::interaction {
namespace {

/// A step is passed when the exponent lies this close below it, so that one set by hand does not stick.
constexpr double same_step = 1.0 + 1e-9;

}  // namespace

double ExponentGesture::step_after(double exponent) const {
  for (const double step : workbench_.options.exponents) {
    if (step > exponent * same_step) return step;
  }
  return workbench_.options.exponents.front();
}

Result<Preview> ExponentGesture::on_frame(const HandFrame& frame) {
  const double dial = frame.sample.potentiometer;
  double wanted = exponent_;
  if (!dial_) {
    dial_ = dial;
    const model::DualPtr shape = workbench_.model.document().find_dual(entity_);
    wanted = step_after(shape ? shape->superellipse_exponent : 1.0);
  } else if (turned_ || std::abs(dial - *dial_) > workbench_.options.dial_slack) {
    turned_ = true;
    const model::Limits& limits = workbench_.model.limits();
    const double low = limits.min_superellipse_exponent;
    const double high = limits.max_superellipse_exponent;
    wanted = std::clamp(low * std::pow(high / low, dial), low, high);
  }
  if (wanted == exponent_) return Preview::same;
  exponent_ = wanted;
  v1::Operation operation;
  operation.mutable_set_superellipse()->set_entity(entity_);
  operation.mutable_set_superellipse()->set_exponent(exponent_);
  if (auto status = air_.set(std::move(operation)); !status) return status.error();
  return Preview::changed;
}

Result<std::optional<model::Submitted>> ExponentGesture::commit() {
  if (!begun()) return std::optional<model::Submitted>();
  return air_.commit();
}

HandActivity ExponentGesture::activity() const {
  return {fmt::format("exponent {:.2g}", exponent_), entity_, {}, {}};
}

}  // namespace handloft::interaction
