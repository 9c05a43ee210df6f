#pragma once
// Words pinned to a place on the model (U6). A comment belongs to the whole design, not to one alternative.
// It goes along when its entity is transformed; a push or a new fit leaves it where it is in space. When its
// entity is deleted it stays at its last place, without one.

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "server-model/geometry/types.h"
#include "server-model/model/similarity.h"

namespace handloft::model {

struct Comment {
  std::string id;
  std::string text;
  std::string entity;                             ///< Pinned to it; empty: to none.
  geometry::Vec3 place = geometry::Vec3::Zero();  ///< World, when `motion` was its entity's.
  std::shared_ptr<const Similarity> motion;       ///< Of the entity; null: it had not been moved.
  std::string reply_to;                           ///< The comment that it answers; empty: none.
  bool resolved = false;
  std::string author;  ///< The user's name; empty in scripts.
  std::uint64_t client_id = 0;
  std::int64_t made_ns = 0;     ///< ns since 1970, UTC; 0: unknown.
  std::int64_t changed_ns = 0;  ///< 0: never.
  std::uint64_t number = 0;     ///< In the order of making, from 1.
};
using CommentPtr = std::shared_ptr<const Comment>;
using Comments = std::map<std::string, CommentPtr, std::less<>>;

}  // namespace handloft::model
