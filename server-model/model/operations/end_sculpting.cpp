// The end of sculpting (D19): the present shape is committed, or the initial one recovered; and more control
// points for what comes next.

#include <fmt/format.h>

#include <utility>

#include "server-model/model/operations/operations.h"
#include "server-model/model/operations/sculpting.h"
#include "server-model/model/sculpt_solve.h"

namespace handloft::model {

namespace v1 = handloft::v1;

namespace {

/// All icons begin anew on the present surface; those that slept sleep on.
Status begin_all(SculptShape& shape, std::string_view field, const Limits& limits) {
  auto icons = std::make_shared<std::vector<SculptIcon>>(*shape.icons);
  for (SculptIcon& icon : *icons) {
    if (auto status = begin_icon(icon, shape, field, limits); !status) return status;
  }
  shape.icons = std::move(icons);
  return {};
}

}  // namespace

Result<Outcome> commit_sculpting(const Document& document, const v1::CommitSculpting& request,
                                 const ApplyContext& context) {
  auto found = require_sculpt(document, request.entity(), "commit_sculpting.entity");
  if (!found) return found.error();
  SculptShape shape = **found;
  shape.rest = shape.surface;
  if (auto status = begin_all(shape, "commit_sculpting", context.limits); !status) return status.error();
  Outcome outcome;
  outcome.document = document;
  *outcome.effective.mutable_commit_sculpting() = request;
  outcome.words = fmt::format("Commit the shape of \"{}\"", shape.name);
  put(outcome.document, std::move(shape));
  return outcome;
}

Result<Outcome> recover_sculpting(const Document& document, const v1::RecoverSculpting& request,
                                  const ApplyContext& context) {
  auto found = require_sculpt(document, request.entity(), "recover_sculpting.entity");
  if (!found) return found.error();
  SculptShape shape = **found;
  shape.rest = shape.initial;
  shape.surface = shape.initial;
  auto icons = std::make_shared<std::vector<SculptIcon>>(*shape.icons);
  for (SculptIcon& icon : *icons) icon.state = IconState::sleeping;
  shape.icons = std::move(icons);
  if (auto status = begin_all(shape, "recover_sculpting", context.limits); !status) return status.error();
  Outcome outcome;
  outcome.document = document;
  *outcome.effective.mutable_recover_sculpting() = request;
  outcome.words = fmt::format("Recover the initial shape of \"{}\"", shape.name);
  put(outcome.document, std::move(shape));
  return outcome;
}

Result<Outcome> refine_surface(const Document& document, const v1::RefineSurface& request,
                               const ApplyContext& context) {
  auto found = require_sculpt(document, request.entity(), "refine_surface.entity");
  if (!found) return found.error();
  SculptShape shape = **found;
  auto surface =
      refined(*shape.surface, request.control_u(), request.control_v(), "refine_surface", context.limits);
  if (!surface) return surface.error();
  // The shape as made keeps its own control points: recovering it is exact to the bit.
  shape.rest = std::make_shared<const geometry::BSplineSurface>(std::move(*surface));
  shape.surface = shape.rest;
  if (auto status = begin_all(shape, "refine_surface", context.limits); !status) return status.error();
  Outcome outcome;
  outcome.document = document;
  *outcome.effective.mutable_refine_surface() = request;
  outcome.words = fmt::format("Refine \"{}\" to {} x {} control points", shape.name,
                              shape.rest->u.control_count(), shape.rest->v.control_count());
  put(outcome.document, std::move(shape));
  return outcome;
}

}  // namespace handloft::model
