// How a surface yields: its energy (D2), what holds its sides, and what is at rest (D4).

#include <fmt/format.h>

#include "server-model/model/operations/operations.h"
#include "server-model/model/operations/sculpting.h"
#include "server-model/model/sculpt_solve.h"

namespace handloft::model {

namespace v1 = handloft::v1;

namespace {

Status take_support(v1::EdgeSupport asked, geometry::Support& support, const std::string& field) {
  switch (asked) {
    case v1::EDGE_SUPPORT_UNSPECIFIED:
      return {};
    case v1::EDGE_FREE:
      support = geometry::Support::free;
      return {};
    case v1::EDGE_SUPPORTED:
      support = geometry::Support::supported;
      return {};
    case v1::EDGE_CLAMPED:
      support = geometry::Support::clamped;
      return {};
    default:
      return make_error(ErrorCode::invalid_argument,
                        fmt::format("found {}, expected EDGE_FREE, EDGE_SUPPORTED or EDGE_CLAMPED",
                                    static_cast<int>(asked)),
                        field);
  }
}

}  // namespace

Result<Outcome> set_sculpting(const Document& document, const v1::SetSculpting& request,
                              const ApplyContext& context) {
  auto found = require_sculpt(document, request.entity(), "set_sculpting.entity");
  if (!found) return found.error();
  SculptShape shape = **found;
  if (request.has_energy()) {
    const v1::SculptEnergy& asked = request.energy();
    shape.energy = {asked.a11(), asked.a12(), asked.a22(), asked.b11(), asked.b12(), asked.b22()};
    if (auto status = geometry::check(shape.energy); !status) {
      Error error = status.error();
      error.field = "set_sculpting." + error.field;
      return error;
    }
  }
  for (const auto& [asked, support, name] :
       {std::tuple{request.u_lower(), &shape.supports.u_lower, "u_lower"},
        std::tuple{request.u_upper(), &shape.supports.u_upper, "u_upper"},
        std::tuple{request.v_lower(), &shape.supports.v_lower, "v_lower"},
        std::tuple{request.v_upper(), &shape.supports.v_upper, "v_upper"}}) {
    if (auto status = take_support(asked, *support, fmt::format("set_sculpting.{}", name)); !status) {
      return status.error();
    }
  }
  switch (request.mode()) {
    case v1::SetSculpting::MODE_UNSPECIFIED:
      break;
    case v1::SetSculpting::DISPLACEMENT:
      shape.absolute = false;
      break;
    case v1::SetSculpting::ABSOLUTE:
      shape.absolute = true;
      break;
    default:
      return make_error(
          ErrorCode::invalid_argument,
          fmt::format("found {}, expected DISPLACEMENT or ABSOLUTE", static_cast<int>(request.mode())),
          "set_sculpting.mode");
  }
  if (request.has_least_squares()) shape.least_squares = request.least_squares();
  Outcome outcome;
  if (auto status = settle(shape, "set_sculpting", context, outcome.notes); !status) return status.error();
  outcome.document = document;
  *outcome.effective.mutable_set_sculpting() = request;
  outcome.words = fmt::format("Set how \"{}\" yields", shape.name);
  put(outcome.document, std::move(shape));
  return outcome;
}

}  // namespace handloft::model
