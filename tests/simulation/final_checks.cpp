#include "tests/simulation/final_checks.h"

#include <algorithm>
#include <map>
#include <string>

#include "server-model/model/canonical.h"
#include "server-model/store/recovery.h"
#include "tests/simulation/same_scene.h"

namespace handloft::simulation {
void check_mirror(const Person& person, const stream::Scene& scene, Judge& judge) {
  for (const std::string& words : differences(*person.mirror().scene(), scene))
    judge.complain("C1: " + person.words() + " has another " + words);
}

namespace {

/// Of the records, against what was told.
void check_records(const store::OperationLog& log, const SimulatedAccess* access, Judge& judge,
                   LogFigures& figures) {
  std::map<std::uint64_t, std::uint64_t> places;          // By client_op_id.
  std::map<std::uint64_t, std::uint64_t> last_of_client;  // The number of its last operation so far.
  const Status read = log.read(1, [&](const store::LogEntry& entry) -> Status {
    const store::LogRecord& record = entry.record;
    ++figures.records;
    if (record.sequence != figures.records) judge.complain("the log has a gap");
    if (record.client_op_id == 0) return {};
    if (!places.emplace(record.client_op_id, record.sequence).second)
      judge.complain("H3: operation " + std::to_string(record.client_op_id) + " is in the log twice");
    if (v1::Operation operation;
        access != nullptr && operation.ParseFromString(record.operation) &&
        access->was_forbidden(Person::number_of(record.client_op_id), operation, operation.made_ns())) {
      judge.complain("U2: operation " + std::to_string(record.client_op_id) +
                     " is of somebody who might not do it");
    }
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

LogFigures check_log(SimulatedServer& server, const std::string& model, const SimulatedAccess* access,
                     Judge& judge) {
  LogFigures figures;
  const session::RoomPtr room = server.room(model);
  if (!room) {
    judge.complain("the model \"" + model + "\" is not open");
    return figures;
  }
  const std::string served = room->actor->state().hash;
  figures.document_hash = served;
  room->store->flush();
  test::FaultDisk disk(server.files());
  store::LogOptions options;
  options.vfs = disk.name();
  options.mark = store::LogOptions::Mark::none;
  const auto log =
      store::OperationLog::open(model.empty() ? "model" : model, store::OperationLog::Access::read, options);
  if (!log) {
    judge.complain("the log cannot be opened: " + log.error().describe());
    return figures;
  }
  check_records(*log, access, judge, figures);
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
