#include "tests/simulation/final_checks.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include "server-model/model/canonical.h"
#include "server-model/store/recovery.h"
#include "server-model/stream/viewer.h"

namespace handloft::simulation {
namespace {

/// The wire's step is a micrometre, and pieces that came at different times have different origins.
constexpr double rounding_m = 2e-6;

bool near(const client::Vec3f& a, const client::Vec3f& b) {
  return std::abs(a.x - b.x) <= rounding_m && std::abs(a.y - b.y) <= rounding_m &&
         std::abs(a.z - b.z) <= rounding_m;
}

bool same_points(const client::PointSet* a, const client::PointSet* b) {
  // Whose last point was deleted is drawn like one that never had any.
  const bool none_a = a == nullptr || a->points.empty();
  const bool none_b = b == nullptr || b->points.empty();
  if (none_a || none_b) return none_a == none_b;
  if (a->points.size() != b->points.size()) return false;
  for (std::size_t i = 0; i < a->points.size(); ++i) {
    if (!near(a->points[i].position, b->points[i].position) ||
        !(a->styles.at(a->points[i].style) == b->styles.at(b->points[i].style)))
      return false;
  }
  return true;
}

bool same_surface(const client::SurfaceMesh* a, const client::SurfaceMesh* b) {
  if (a == nullptr || b == nullptr) return a == b;
  if (a->indices != b->indices || a->vertices.size() != b->vertices.size()) return false;
  for (std::size_t i = 0; i < a->vertices.size(); ++i) {
    const client::SurfaceVertex& one = a->vertices[i];
    const client::SurfaceVertex& other = b->vertices[i];
    if (!(one.position == other.position) || !(one.normal == other.normal) || one.opacity != other.opacity)
      return false;
  }
  return true;
}

template <typename T>
bool same_list(const std::shared_ptr<const std::vector<T>>& a,
               const std::shared_ptr<const std::vector<T>>& b) {
  const bool none_a = !a || a->empty();
  const bool none_b = !b || b->empty();
  return none_a || none_b ? none_a == none_b : *a == *b;
}

/// In what they differ; empty: in nothing.
std::string difference(const client::Entity& a, const client::Entity& b) {
  if (a.name != b.name) return "name";
  if (a.kind != b.kind) return "kind";
  if (a.revision != b.revision) return "revision";
  if (a.representation != b.representation) return "representation";
  if (a.provisional != b.provisional) return "provisional";
  if (!same_points(a.points.get(), b.points.get())) return "points";
  if (!same_surface(a.surface.get(), b.surface.get())) {
    const auto size = [](const auto& surface) { return surface ? surface->vertices.size() : 0; };
    return fmt::format("surface ({} vertices for {})", size(a.surface), size(b.surface));
  }
  if (!same_list(a.curves, b.curves)) return "curves";
  if (!same_list(a.icons, b.icons)) return "icons";
  if (!same_list(a.distances_m, b.distances_m)) return "distances";
  if (std::abs(a.residual_rms_m - b.residual_rms_m) > 1e-12) return "residual";
  return {};
}

}  // namespace

void check_mirror(const Person& person, const stream::Scene& scene, Judge& judge) {
  stream::Viewer viewer;
  client::SceneMirror fresh;
  while (const auto message = viewer.next(scene)) {
    const Status applied =
        message->has_snapshot() ? fresh.apply(message->snapshot()) : fresh.apply(message->delta());
    if (!applied) {
      judge.complain("nobody could join now: " + applied.error().describe());
      return;
    }
  }
  const client::Scene& expected = *fresh.scene();
  const client::Scene& found = *person.mirror().scene();
  const auto complain = [&](const std::string& words) {
    judge.complain("C1: " + person.words() + " has another " + words);
  };
  if (found.epoch != expected.epoch || found.sequence != expected.sequence)
    complain("sequence than " + std::to_string(expected.sequence));
  if (found.alternatives.present != expected.alternatives.present ||
      found.alternatives.names != expected.alternatives.names)
    complain("list of alternatives");
  if (found.entities.size() != expected.entities.size()) complain("number of entities");
  for (const auto& [id, entity] : expected.entities) {
    const auto its = found.entities.find(id);
    if (its == found.entities.end()) {
      complain("scene: \"" + id + "\" is missing");
      continue;
    }
    const std::string what = difference(*its->second, *entity);
    if (!what.empty()) complain(what + " of \"" + id + "\"");
  }
}

namespace {

/// Of the records, against what was told.
void check_records(const store::OperationLog& log, Judge& judge, LogFigures& figures) {
  std::map<std::uint64_t, std::uint64_t> places;          // By client_op_id.
  std::map<std::uint64_t, std::uint64_t> last_of_client;  // The number of its last operation so far.
  const Status read = log.read(1, [&](const store::LogEntry& entry) -> Status {
    const store::LogRecord& record = entry.record;
    ++figures.records;
    if (record.sequence != figures.records) judge.complain("the log has a gap");
    if (record.client_op_id == 0) return {};
    if (!places.emplace(record.client_op_id, record.sequence).second)
      judge.complain("H3: operation " + std::to_string(record.client_op_id) + " is in the log twice");
    // One that was refused, unheard, may be possible when it is sent again.
    const auto told = judge.told().find(record.client_op_id);
    const bool once = told != judge.told().end() && told->second.times_sent == 1;
    std::uint64_t& last = last_of_client[record.client_id];
    if (once && record.client_op_id < last)
      judge.complain("operation " + std::to_string(record.client_op_id) + " came after a later one");
    last = std::max(last, record.client_op_id);
    return {};
  });
  if (!read) judge.complain("the log cannot be read: " + read.error().describe());
  for (const auto& [op, told] : judge.told()) {
    const auto place = places.find(op);
    const std::string its_name = "operation " + std::to_string(op);
    if (told.promise == Judge::Promise::durable) {
      if (place == places.end()) {
        judge.complain("D1: " + its_name + " was acknowledged and is lost");
      } else if (place->second != told.sequence) {
        judge.complain(its_name + " is not where its answer said");
      }
    } else if (told.promise == Judge::Promise::refused && place != places.end()) {
      judge.complain(its_name + " was refused and done");
    }
  }
  for (const auto& [op, place] : places) {
    if (!judge.told().contains(op)) judge.complain("operation " + std::to_string(op) + " is nobody's");
  }
}

}  // namespace

LogFigures check_log(SimulatedServer& server, Judge& judge) {
  LogFigures figures;
  const std::string served = server.peers().actor().state().hash;
  figures.document_hash = served;
  server.store().flush();
  test::FaultDisk disk(server.files());
  store::LogOptions options;
  options.vfs = disk.name();
  options.mark = store::LogOptions::Mark::none;
  const auto log = store::OperationLog::open("model", store::OperationLog::Access::read, options);
  if (!log) {
    judge.complain("the log cannot be opened: " + log.error().describe());
    return figures;
  }
  check_records(*log, judge, figures);
  for (const auto snapshots :
       {store::RecoveryOptions::Snapshots::used, store::RecoveryOptions::Snapshots::ignored}) {
    store::RecoveryOptions how;
    how.snapshots = snapshots;
    const auto replayed = store::recover(*log, {}, how);
    if (!replayed) {
      judge.complain("D6: the log cannot be replayed: " + replayed.error().describe());
    } else if (model::document_hash(replayed->model.document()) != served) {
      judge.complain("D6: the log, replayed, gives another document");
    }
  }
  return figures;
}

}  // namespace handloft::simulation
