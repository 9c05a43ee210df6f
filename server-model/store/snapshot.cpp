#include "server-model/store/snapshot.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "server-model/model/canonical.h"
#include "server-model/store/log_schema.h"

namespace handloft::store {

Result<PreparedSnapshot> prepare_snapshot(const model::StoredState& state,
                                          const model::EncodeOptions& options) {
  return prepare_snapshot(model::KeptState{state.history.kept(options.max_steps), state.sequence}, options);
}

Result<PreparedSnapshot> prepare_snapshot(const model::KeptState& state,
                                          const model::EncodeOptions& options) {
  PreparedSnapshot snapshot;
  snapshot.sequence = state.sequence;
  snapshot.document_hash = model::document_hash(state.history.current);
  std::map<std::string, std::size_t, std::less<>> places;
  auto manifest = model::encode_state(
      state,
      [&](std::string_view sha256, std::string_view bytes) -> Status {
        if (!places.emplace(sha256, snapshot.parts.size()).second) return {};
        Digest digest{};
        std::copy(sha256.begin(), sha256.end(), reinterpret_cast<char*>(digest.data()));
        snapshot.parts.emplace_back(digest, bytes);
        return {};
      },
      options);
  if (!manifest) return manifest.error();
  snapshot.manifest = *std::move(manifest);
  snapshot.manifest_hash = model::content_hash(snapshot.manifest);
  const auto restored =
      model::decode_state(snapshot.manifest, [&](std::string_view sha256) -> Result<std::string> {
        const auto found = places.find(sha256);
        if (found == places.end()) return make_error(ErrorCode::not_found, "a part is missing");
        return snapshot.parts[found->second].second;
      });
  if (!restored) return restored.error();
  if (const std::string hash = model::document_hash(restored->history.current());
      hash != snapshot.document_hash) {
    return make_error(ErrorCode::internal, fmt::format("the snapshot at {} restores {:.16}, expected {:.16}",
                                                       state.sequence, hash, snapshot.document_hash));
  }
  return snapshot;
}

Result<bool> SnapshotWriter::step() {
  if (!log_.failure()) return log_.failure().error();
  Status status;
  switch (phase_) {
    case Phase::parts:
      status = write_parts();
      break;
    case Phase::manifest:
      status = write_manifest();
      break;
    case Phase::read_back:
      status = read_back();
      break;
    case Phase::switch_over:
      status = switch_over();
      break;
    case Phase::done:
      break;
  }
  if (!status) {
    log_.database().rollback();
    if (status.error().code == ErrorCode::data_corrupt) return status.error();
    return log_.fail(status.error()).error();
  }
  return phase_ == Phase::done;
}

Status SnapshotWriter::write_parts() {
  Database& database = log_.database();
  if (auto status = database.begin(); !status) return status;
  // One that is there already, of the snapshot before, is written over when its content is not what its name
  // says.
  Statement known = database.prepare("SELECT content FROM parts WHERE sha256 = ?1");
  Statement insert = database.prepare("INSERT OR REPLACE INTO parts VALUES (?1, ?2)");
  std::size_t bytes = 0;
  for (; next_part_ < snapshot_.parts.size() && bytes < bytes_per_step; ++next_part_) {
    const auto& [digest, content] = snapshot_.parts[next_part_];
    known.bind_bytes(1, model::as_bytes(digest));
    const bool there = known.step() == Statement::Step::row && known.bytes(0) == content;
    known.reset();
    bytes += content.size();
    if (there) continue;
    insert.bind_bytes(1, model::as_bytes(digest)).bind_bytes(2, content);
    if (!insert.run()) return database.error("write a part of a snapshot");
  }
  if (next_part_ == snapshot_.parts.size()) phase_ = Phase::manifest;
  return database.commit();
}

Status SnapshotWriter::write_manifest() {
  Database& database = log_.database();
  if (auto status = database.begin(); !status) return status;
  auto last = database.integer("SELECT coalesce(max(id), 0) FROM snapshots");
  if (!last) return last.error();
  id_ = *last + 1;
  Statement row = database.prepare("INSERT INTO snapshots VALUES (?1,?2,?3,?4,?5,?6,?7,0)");
  row.bind(1, id_)
      .bind(2, only_line)
      .bind(3, snapshot_.sequence)
      .bind(4, std::string_view(snapshot_.document_hash))
      .bind_bytes(5, model::as_bytes(snapshot_.manifest_hash))
      .bind_bytes(6, snapshot_.manifest)
      .bind(7, now_ns_);
  if (!row.run()) return database.error("write a snapshot");
  Statement part = database.prepare("INSERT INTO snapshot_parts VALUES (?1, ?2)");
  for (const auto& [digest, content] : snapshot_.parts) {
    part.bind(1, id_).bind_bytes(2, model::as_bytes(digest));
    if (!part.run()) return database.error("write a snapshot");
  }
  phase_ = Phase::read_back;
  next_part_ = 0;
  return database.commit();
}

Status SnapshotWriter::read_back() {
  if (next_part_ == 0) {
    SnapshotRow row;
    row.id = id_;
    row.sequence = snapshot_.sequence;
    row.manifest_hash = snapshot_.manifest_hash;
    if (auto manifest = log_.manifest(row); !manifest) return manifest.error();
  }
  std::size_t bytes = 0;
  for (; next_part_ < snapshot_.parts.size() && bytes < bytes_per_step; ++next_part_) {
    auto content = log_.part(model::as_bytes(snapshot_.parts[next_part_].first));
    if (!content) return make_error(ErrorCode::data_corrupt, content.error().message);
    bytes += content->size();
  }
  if (next_part_ == snapshot_.parts.size()) phase_ = Phase::switch_over;
  return {};
}

Status SnapshotWriter::switch_over() {
  Database& database = log_.database();
  if (auto status = database.begin(); !status) return status;
  const std::string kept =
      fmt::format("(SELECT id FROM snapshots WHERE verified = 1 ORDER BY id DESC LIMIT {})", kept_snapshots);
  for (const std::string& sql :
       {fmt::format("UPDATE snapshots SET verified = 1 WHERE id = {}", id_),
        "DELETE FROM snapshots WHERE id NOT IN " + kept,
        std::string("DELETE FROM snapshot_parts WHERE snapshot NOT IN (SELECT id FROM snapshots)"),
        std::string("DELETE FROM parts WHERE sha256 NOT IN (SELECT sha256 FROM snapshot_parts)")}) {
    if (auto status = database.execute(sql); !status) return status;
  }
  phase_ = Phase::done;
  return database.commit();
}

Status write_snapshot(OperationLog& log, PreparedSnapshot snapshot, std::int64_t now_ns) {
  SnapshotWriter writer(log, std::move(snapshot), now_ns);
  for (;;) {
    auto done = writer.step();
    if (!done) return done.error();
    if (*done) return {};
  }
}

}  // namespace handloft::store
