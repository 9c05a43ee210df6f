#include "server-model/store/summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "proto/storage.pb.h"
#include "server-model/store/recovery.h"

namespace handloft::store {

namespace v1 = handloft::v1;

namespace {

void sort_by_sequence(std::vector<NamedVersion>& versions) {
  std::stable_sort(versions.begin(), versions.end(),
                   [](const NamedVersion& a, const NamedVersion& b) { return a.sequence < b.sequence; });
}

/// False: nothing that this program can read; a restart would use an older one.
bool read_manifest(const std::string& manifest, Summary& summary) {
  v1::StoredModel stored;
  if (manifest.size() > static_cast<std::size_t>(std::numeric_limits<int>::max()) ||
      !stored.ParseFromArray(manifest.data(), static_cast<int>(manifest.size())))
    return false;
  // Version 1 knew no named versions, and tells its alternatives step by step.
  if (stored.version() < 2) return false;
  for (const std::uint32_t place : stored.current().versions()) {
    if (place >= static_cast<std::uint32_t>(stored.versions_size())) return false;
    const v1::StoredVersion& version = stored.versions(static_cast<int>(place));
    summary.versions.push_back({version.name(), version.note(), version.author(), version.alternative(),
                                version.made_ns(), version.sequence()});
  }
  sort_by_sequence(summary.versions);
  for (const v1::StoredAlternative& alternative : stored.current().alternatives())
    summary.alternatives.push_back({alternative.name(), alternative.version()});
  return true;
}

void read_document(const model::Document& document, Summary& summary) {
  summary.versions = named_versions(document);
  summary.alternatives = named_alternatives(document);
}

/// Whether an operation from this one on has changed versions or alternatives.
Result<bool> changed_from(const OperationLog& log, std::uint64_t sequence) {
  Statement rows = log.database().prepare("SELECT answer FROM operations WHERE place BETWEEN ?1 AND ?2");
  rows.bind(1, row_place(std::min(sequence, max_sequence))).bind(2, row_place(max_sequence));
  v1::StoredAnswer answer;
  auto step = rows.step();
  for (; step == Statement::Step::row; step = rows.step()) {
    const std::string_view bytes = rows.bytes(0);
    if (!answer.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())))
      return make_error(ErrorCode::data_corrupt, "found an answer that cannot be read");
    if (answer.versions() || answer.alternatives()) return true;
  }
  if (step == Statement::Step::failed) return log.database().error("read answers");
  return false;
}

}  // namespace

std::vector<NamedVersion> named_versions(const model::Document& document) {
  std::vector<NamedVersion> versions;
  for (const auto& [name, version] : *document.versions) {
    versions.push_back({version->name, version->note, version->author, version->alternative, version->made_ns,
                        version->sequence});
  }
  sort_by_sequence(versions);
  return versions;
}

std::vector<NamedAlternative> named_alternatives(const model::Document& document) {
  std::vector<NamedAlternative> alternatives;
  for (const model::Alternative& alternative : *document.alternatives)
    alternatives.push_back({alternative.name, alternative.version});
  return alternatives;
}

Result<Summary> summarize(const OperationLog& log, const model::ApplyContext& context) {
  Summary summary;
  summary.operations = log.last_sequence();
  summary.created_ns = summary.changed_ns = log.identity().created_ns;
  if (summary.operations > 0) {
    Statement last = log.database().prepare("SELECT time_ns FROM operations WHERE place = ?1");
    last.bind(1, row_place(summary.operations));
    if (last.step() != Statement::Step::row) return log.database().error("read the last operation");
    summary.changed_ns = last.integer(0);
  }
  bool known = false;
  auto snapshots = log.snapshots();
  if (snapshots && !snapshots->empty()) {
    const SnapshotRow& newest = snapshots->front();
    const auto manifest = log.manifest(newest);
    known = manifest && newest.sequence <= summary.operations && read_manifest(*manifest, summary);
    if (known) summary.snapshot_sequence = newest.sequence;
  } else if (snapshots) {
    read_document(model::Document(), summary);
    known = true;
  }
  if (known) {
    auto changed = changed_from(log, summary.snapshot_sequence + 1);
    if (!changed) return changed.error();
    known = !*changed;
  }
  if (!known) {
    auto recovered = recover(log, context);
    if (!recovered) return recovered.error();
    read_document(recovered->model.document(), summary);
    summary.restored = true;
  }
  return summary;
}

}  // namespace handloft::store
