#pragma once
// The tables of a log, version 3. A newer version adds to them; what is here never changes its meaning (D8).
// Version 1 had no `rules`, and two tables, of branches and versions, which nothing ever filled: they stay in
// such files, and nobody reads them. Version 2 had `rules` without `fair_from`.

#include <cstdint>

namespace handloft::store {

inline constexpr std::int64_t application_id = 0x484c4f47;  ///< "HLOG"
inline constexpr std::int64_t schema_version = 3;
inline constexpr std::int64_t rules_since = 2;
inline constexpr std::int64_t fair_since = 3;

/// Format 1 foresaw several lines of operations: this is the number of the one that there is.
inline constexpr std::uint64_t only_line = 1;

inline constexpr const char* schema = R"sql(
CREATE TABLE model (
  id INTEGER PRIMARY KEY CHECK (id = 1),
  model_id BLOB NOT NULL,
  created_ns INTEGER NOT NULL
) STRICT;
-- place = 2^40 + sequence
CREATE TABLE operations (
  place INTEGER PRIMARY KEY,
  epoch INTEGER NOT NULL,
  client_id INTEGER NOT NULL,
  client_op_id INTEGER NOT NULL,
  time_ns INTEGER NOT NULL,
  operation BLOB NOT NULL,
  answer BLOB NOT NULL,
  chain BLOB NOT NULL
) STRICT;
CREATE UNIQUE INDEX retries ON operations (client_id, client_op_id) WHERE client_op_id <> 0;
CREATE TABLE audit (
  id INTEGER PRIMARY KEY,
  time_ns INTEGER NOT NULL,
  client_id INTEGER NOT NULL,
  kind TEXT NOT NULL,
  words TEXT NOT NULL,
  check_value BLOB NOT NULL
) STRICT;
CREATE TABLE snapshots (
  id INTEGER PRIMARY KEY,
  branch INTEGER NOT NULL,
  sequence INTEGER NOT NULL,
  document_hash TEXT NOT NULL,
  manifest_hash BLOB NOT NULL,
  manifest BLOB NOT NULL,
  time_ns INTEGER NOT NULL,
  verified INTEGER NOT NULL
) STRICT;
CREATE TABLE parts (
  sha256 BLOB PRIMARY KEY,
  content BLOB NOT NULL
) STRICT;
CREATE TABLE snapshot_parts (
  snapshot INTEGER NOT NULL,
  sha256 BLOB NOT NULL,
  PRIMARY KEY (snapshot, sha256)
) STRICT, WITHOUT ROWID;
)sql";

/// Which rules the operations were applied by. Comes into a file of an older version with the first operation
/// that is appended, which makes it version 3.
inline constexpr const char* rules_schema = R"sql(
CREATE TABLE rules (
  id INTEGER PRIMARY KEY CHECK (id = 1),
  per_user_from INTEGER NOT NULL,
  fair_from INTEGER NOT NULL,
  check_value BLOB NOT NULL
) STRICT;
)sql";

}  // namespace handloft::store
