#pragma once
// What lies beside the file of a model or of users: SQLite's journals and index, and our mark (ack_mark.h).

#include <array>

namespace handloft::store {

inline constexpr const char* mark_suffix = "-mark";
/// SQLite's, while the file is open or after a crash.
inline constexpr std::array database_side_suffixes{"-wal", "-shm", "-journal"};
/// All that there may be.
inline constexpr std::array side_suffixes{"-wal", "-shm", "-journal", mark_suffix};

}  // namespace handloft::store
