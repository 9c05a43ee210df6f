#include "server-model/session/report.h"

#include <nlohmann/json.hpp>

#include "server-model/exchange/atomic_file.h"

namespace handloft::session {
namespace {

using Json = nlohmann::ordered_json;

Json entity_json(const model::DualShape& shape) {
  Json json{{"id", shape.id},
            {"name", shape.name},
            {"points", shape.points.size()},
            {"strokes", shape.stroke_count},
            {"fitted", shape.fitted()},
            {"symmetry", std::string(model::to_string(shape.symmetry))},
            {"partner", shape.partner}};
  if (shape.fit) {
    json["degree"] = shape.fit->surface.degree();
    json["stale"] = shape.stale;
    json["residual_rms_m"] = shape.fit->statistics.rms;
    json["residual_max_m"] = shape.fit->statistics.max;
  }
  return json;
}

Json latency_json(const LatencySummary& latency) {
  return {{"count", latency.count},
          {"median_ms", latency.median_ms},
          {"p99_ms", latency.p99_ms},
          {"max_ms", latency.max_ms}};
}

}  // namespace

std::string report_json(const SessionFigures& figures) {
  const ActorState& state = figures.state;
  Json entities = Json::array();
  std::size_t points = 0;
  for (const auto& [id, entity] : state.document.entities) {
    const model::DualPtr shape = model::as_dual(entity);
    if (!shape) {
      entities.push_back({{"id", id}, {"name", entity->name}, {"kind", model::to_string(entity->kind())}});
      continue;
    }
    entities.push_back(entity_json(*shape));
    points += shape->points.size();
  }
  const Json json{{"hash", state.hash},
                  {"sequence", state.sequence},
                  {"entity_count", state.document.entities.size()},
                  {"point_count", points},
                  {"entities", entities},
                  {"tracking",
                   {{"frames", state.tracking.frames},
                    {"gaps", state.tracking.gaps},
                    {"resets", state.tracking.resets},
                    {"frames_ignored", state.interaction.frames_ignored},
                    {"frames_out_of_order", state.interaction.frames_out_of_order}}},
                  {"client_hands",
                   {{"frames", state.client_frames.frames},
                    {"replaced", state.client_frames.replaced},
                    {"left_out", state.client_frames.left_out}}},
                  {"gestures",
                   {{"points_laid", state.interaction.points_laid},
                    {"strokes_committed", state.interaction.strokes_committed},
                    {"strokes_cancelled", state.interaction.strokes_cancelled},
                    {"commands", state.interaction.commands},
                    {"refused", state.interaction.refused}}},
                  {"meshes", {{"made", state.meshes.made}, {"failed", state.meshes.failed}}},
                  {"clients", figures.clients_served},
                  {"latency", {{"capture_to_delta", latency_json(figures.capture_to_delta)}}}};
  // Names come from people: what is not UTF-8 is replaced rather than refused.
  constexpr int indent = 2;
  return json.dump(indent, ' ', false, Json::error_handler_t::replace) + "\n";
}

Status write_report(const std::filesystem::path& path, const SessionFigures& figures) {
  return exchange::write_file_atomically(path, std::string_view(report_json(figures)));
}

}  // namespace handloft::session
