#pragma once
// What a script drives: a model in this process, or a running server.

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "proto/operation.pb.h"
#include "proto/query.pb.h"

namespace handloft::model {

/// Not thread-safe; calls block until they are answered.
class ScriptTarget {
 public:
  struct Outcome {
    std::uint64_t sequence = 0;         ///< 0: nothing changed.
    std::vector<std::string> entities;  ///< Created, changed or removed, ascending.
    std::vector<std::string> notes;     ///< Warnings in words.
    bool durable = false;               ///< It is on the disk of whoever keeps the model.
  };

  virtual ~ScriptTarget() = default;
  virtual Result<Outcome> submit(const handloft::v1::Operation& operation) = 0;
  virtual Result<handloft::v1::QueryResult> query(const handloft::v1::Query& query) = 0;
};

}  // namespace handloft::model
