#pragma once
// The tables of an access file. `format` grows when older programs could not read it.

namespace handloft::access {

inline constexpr int access_format = 1;
inline constexpr int access_application = 0x484C4143;  // "HLAC"

inline constexpr const char* access_tables = R"(
CREATE TABLE facts (name TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE users (name TEXT PRIMARY KEY, made_s INTEGER NOT NULL, revoked_s INTEGER NOT NULL DEFAULT 0) WITHOUT ROWID;
CREATE TABLE roles (user TEXT NOT NULL, model TEXT NOT NULL, role INTEGER NOT NULL, PRIMARY KEY (user, model)) WITHOUT ROWID;
CREATE TABLE devices (number INTEGER PRIMARY KEY, fingerprint TEXT NOT NULL UNIQUE, user TEXT NOT NULL, name TEXT NOT NULL,
  paired_s INTEGER NOT NULL, until_s INTEGER NOT NULL, revoked_s INTEGER NOT NULL DEFAULT 0);
CREATE TABLE invitations (number INTEGER PRIMARY KEY, salt BLOB NOT NULL, hash BLOB NOT NULL, user TEXT NOT NULL,
  model TEXT NOT NULL, role INTEGER NOT NULL, until_s INTEGER NOT NULL, attempts_left INTEGER NOT NULL);
CREATE TABLE audit (number INTEGER PRIMARY KEY AUTOINCREMENT, time_ns INTEGER NOT NULL, kind TEXT NOT NULL, user TEXT NOT NULL,
  device TEXT NOT NULL, address TEXT NOT NULL, model TEXT NOT NULL, detail TEXT NOT NULL);
)";

}  // namespace handloft::access
