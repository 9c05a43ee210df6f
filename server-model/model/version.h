#pragma once
// A design as it was, under a name (U6): what one alternative held when it was named. The entities are shared
// with every document that has them.

#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "server-model/model/entity.h"

namespace handloft::model {

struct Version {
  std::string name;
  std::string note;
  std::string author;          ///< The user's name; empty in scripts.
  std::int64_t made_ns = 0;    ///< ns since 1970, UTC; 0: unknown.
  std::string alternative;     ///< Whose it is.
  std::uint64_t sequence = 0;  ///< Of the operation that named it; 0: made outside of a model.
  std::string parent;          ///< The version that its alternative was at before; empty: none.
  std::shared_ptr<const Entities> entities;
  /// SHA-256 of the canonical form of the entities: so that the hash of a document need not read them.
  std::string digest;
};
using VersionPtr = std::shared_ptr<const Version>;
using Versions = std::map<std::string, VersionPtr, std::less<>>;

}  // namespace handloft::model
