#pragma once
// What one step of history changed, both ways, so that it can be taken back where other people have gone on
// (U1): per entity by identity of its value, and likewise alternatives, named versions and comments. Taking
// it back touches nothing else, and is in conflict where one of these is no longer as the step left it.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server-model/model/document.h"

namespace handloft::model {

struct StepDelta {
  template <typename Value>
  struct Change {
    std::string id;
    Value before, after;  ///< Null: there was none.
  };
  /// An alternative as a whole: made or deleted. `alternative.entities` is never null.
  struct Whole {
    std::size_t place = 0;  ///< Among the alternatives.
    Alternative alternative;
  };
  /// Which version an alternative is at.
  struct At {
    std::string alternative, before, after;
  };

  std::string alternative;                    ///< Whose the entities are; empty when none changed.
  std::vector<Change<EntityPtr>> entities;    ///< Ascending.
  std::vector<Whole> made, deleted;           ///< Ascending by place.
  std::string present_before, present_after;  ///< The alternative worked on.
  std::vector<At> at;
  std::vector<Change<VersionPtr>> versions;  ///< Ascending.
  std::vector<Change<CommentPtr>> comments;  ///< Ascending.
  std::vector<std::string> ids;              ///< Used by this step for the first time, ascending.
  std::uint64_t next_shape_before = 1, next_shape_after = 1;
  std::uint64_t next_comment_before = 1, next_comment_after = 1;
};

/// O(entities). Precondition: entities of one alternative differ at most, as after one operation.
StepDelta delta_between(const Document& before, const Document& after);

enum class Direction : std::uint8_t { back, forth };

/// What stands in the way of a step.
struct Conflict {
  enum class Kind : std::uint8_t { entity, alternative, present, version, comment };
  Kind kind = Kind::entity;
  std::string id;  ///< The entity, alternative, version or comment; empty for `present`.
};

/// nullopt: the step can be taken back (done again). O(what it changed), for deleted and made alternatives
/// and named versions O(entities).
std::optional<Conflict> conflict(const Document& current, const StepDelta& delta, Direction direction);

/// What becomes of the ids and numbers that a step has given out when it is taken back. They are free again
/// only while nobody else has gone on: versions and alternatives may hold what has them.
enum class Given : std::uint8_t { kept, freed };

/// The document with the step taken back (done again). Precondition: no conflict.
Document stepped(const Document& current, const StepDelta& delta, Direction direction, Given given);

/// The step with the places where the alternatives are now that it makes vanish: there they come again,
/// whatever others have made before them. nullopt: they are where they were.
std::optional<StepDelta> placed(const Document& current, const StepDelta& delta, Direction direction);

/// The first thing that two steps both changed; nullopt: there is none.
std::optional<Conflict> in_common(const StepDelta& a, const StepDelta& b);

/// For people: `"Seat"`, `the alternative "wide"`.
std::string describe(const Conflict& conflict, const StepDelta& delta);

}  // namespace handloft::model
