#pragma once
// A small file beside a log, FILE-mark, with two uses. Its lock says which process writes the log, so that
// there are never two. And it tells how far the log was durable: SQLite takes a write-ahead log only up to
// the first frame that is damaged, which looks as if those after it had never been written; the mark knows
// better. It is written after each commit and not flushed: after a power failure it may lag behind, never run
// ahead.

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "common/base/result.h"
#include "server-model/model/content_hash.h"

namespace handloft::store {

class AckMark {
 public:
  struct Mark {
    std::uint64_t sequence = 0;
    model::ContentHash::Digest chain{};
    bool operator==(const Mark&) const = default;
  };

  /// Of the file itself, by whatever link it is called, as SQLite's journal.
  static std::string path_of(const std::filesystem::path& log);
  /// Errors: failed_precondition when another process writes this log; io.
  static Result<AckMark> lock(const std::filesystem::path& log);
  /// What it says; nullopt when there is none, or it is damaged: then nothing is known.
  static std::optional<Mark> read(const std::filesystem::path& log);

  AckMark() = default;
  AckMark(AckMark&& other) noexcept;
  AckMark& operator=(AckMark&& other) noexcept;
  ~AckMark();

  /// As well as it can: its loss is no loss of the log.
  void write(const Mark& mark);

 private:
  int file_ = -1;
};

}  // namespace handloft::store
