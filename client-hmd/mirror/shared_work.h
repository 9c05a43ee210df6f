#pragma once
// What people who work on one model tell each other through the server (U1, U5, U6): whether it is
// saved, who is here as what, comments pinned to places, and named versions. As received and checked.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace handloft::client {

/// Whether what is seen is safe (U5).
struct Storage {
  bool told = false;  ///< An older server says nothing.
  bool kept = false;  ///< In a file.
  std::uint64_t durable_sequence = 0;
  std::string problem;  ///< Why nothing more can be kept; empty: it can.
  bool operator==(const Storage&) const = default;
};

/// Only what is on the disk is called saved.
enum class SavedState {
  unknown,   ///< Nothing is told.
  saved,     ///< All that is seen.
  saving,    ///< The newest changes are not on the disk yet.
  not_kept,  ///< The server keeps nothing in a file.
  failing,   ///< It cannot.
};
SavedState saved_state(const Storage& storage, std::uint64_t sequence);

/// Words pinned to a place (U6). World, metres.
struct PinnedComment {
  std::string id;
  std::string text;
  std::string entity;  ///< Empty: none, or it is gone.
  float x = 0.0F, y = 0.0F, z = 0.0F;
  bool placed = false;
  std::string reply_to;  ///< Empty: it begins a thread.
  bool resolved = false;
  std::string author;
  std::int64_t made_ns = 0;  ///< Since 1970, UTC; 0: unknown.
  std::uint64_t client_id = 0;
  bool operator==(const PinnedComment&) const = default;
};

/// Those that begin a thread and are not resolved, in the order of making: a pin's number is its place in it,
/// from 1.
std::vector<const PinnedComment*> open_threads(const std::vector<PinnedComment>& comments);

/// A design as it was, under a name (U6).
struct NamedVersion {
  std::string name;
  std::string note;
  std::string author;
  std::int64_t made_ns = 0;
  std::string alternative;
  bool operator==(const NamedVersion&) const = default;
};

/// What was done from one version to another, in the server's words (U6).
struct VersionDifference {
  std::string from;
  std::string to;       ///< Empty: the present.
  bool asking = false;  ///< No answer yet.
  std::vector<std::string> sentences;
  std::string refusal;  ///< Why there is no answer; empty: there is.
  bool operator==(const VersionDifference&) const = default;
};

/// Who is connected, from the server (U1).
struct PersonHere {
  std::uint64_t client_id = 0;
  std::string user;  ///< Who it has proved to be.
  std::string name;  ///< What it calls itself.
  std::string role;  ///< "owner", "editor", "commenter", "viewer"
  bool operator==(const PersonHere&) const = default;
};

}  // namespace handloft::client
