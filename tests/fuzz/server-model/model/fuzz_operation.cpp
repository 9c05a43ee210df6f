// Any bytes that parse as operations, applied to a document: never a crash, never NaN, nothing changed on
// refusal (X5). The input is a sequence of operations, each a two-byte little-endian length and the message.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "server-model/model/canonical.h"
#include "server-model/model/model.h"
#include "server-model/model/sculpt_shape.h"

namespace {

using handloft::model::Document;
using handloft::model::Model;

void require(bool good) {
  if (!good) std::abort();
}

void require_finite(const Document& document) {
  for (const auto& [id, entity] : document.entities) {
    if (const handloft::model::SculptPtr sculpt = handloft::model::as_sculpt(entity)) {
      for (const auto& surface : {sculpt->initial, sculpt->rest, sculpt->surface}) {
        for (const auto& point : surface->control) require(point.allFinite());
      }
      require(sculpt->surface->control.size() == sculpt->rest->control.size());
      for (const auto& icon : *sculpt->icons) require(icon.place.allFinite());
    }
    const handloft::model::DualPtr shape = handloft::model::as_dual(entity);
    if (!shape) continue;
    for (const auto& point : shape->points)
      require(point.position().allFinite() && std::isfinite(point.pressure));
    if (!shape->fit) continue;
    require(shape->fit->frame.origin.allFinite() && shape->fit->frame.rotation.allFinite());
    for (const double coefficient : shape->fit->surface.coefficients()) require(std::isfinite(coefficient));
    for (const double residual : shape->fit->residuals_m) require(std::isfinite(residual));
  }
}

Model start() {
  Model model;
  handloft::v1::Operation operation;
  operation.mutable_add_points()->set_entity("a");
  operation.mutable_add_points()->mutable_create();
  for (int i = 0; i < 12; ++i) {
    auto& point = *operation.mutable_add_points()->add_points();
    point.mutable_position()->set_x(0.01 * (i % 4));
    point.mutable_position()->set_y(0.01 * (i / 4));
    point.mutable_position()->set_z(0.001 * (i % 3));
    point.set_pressure(0.5);
  }
  require(model.submit(operation).ok());
  auto& sheet = *operation.mutable_create_sculpt_surface();
  sheet.set_id("sheet");
  sheet.mutable_rectangle()->set_width_m(0.2);
  sheet.mutable_rectangle()->set_depth_m(0.15);
  sheet.set_control_u(6);
  sheet.set_control_v(6);
  require(model.submit(operation).ok());
  return model;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Model model = start();
  while (size >= 2) {
    const std::size_t length = std::min<std::size_t>(data[0] + std::size_t{256} * data[1], size - 2);
    handloft::v1::Operation operation;
    const bool parsed = operation.ParseFromArray(data + 2, static_cast<int>(length));
    data += 2 + length;
    size -= 2 + length;
    if (!parsed) continue;
    const std::string before = handloft::model::document_hash(model.document());
    const auto submitted = model.submit(operation);
    if (!submitted || submitted->sequence == 0) {
      require(handloft::model::document_hash(model.document()) == before);
    } else {
      require_finite(model.document());
    }
  }
  return 0;
}
