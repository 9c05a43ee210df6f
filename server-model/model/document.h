#pragma once
// The document is a value (architecture idea 3): a small map of immutable, shared entities. Applying an
// operation yields a new document that shares all the rest; on refusal there is none, so a refused operation
// changes nothing.

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "proto/operation.pb.h"
#include "server-model/geometry/propagation.h"
#include "server-model/model/comment.h"
#include "server-model/model/dual_shape.h"
#include "server-model/model/entity.h"
#include "server-model/model/limits.h"
#include "server-model/model/version.h"

namespace handloft::model {

/// A named design among several (A28).
struct Alternative {
  using Entities = model::Entities;

  std::string name;
  std::shared_ptr<const Entities> entities;  ///< Null for the present one, whose are Document::entities.
  std::string version{};  ///< The version that it was named as, restored to or begun from last; empty: none.
};
using Alternatives = std::vector<Alternative>;

struct Document {
  using Entities = Alternative::Entities;
  using Ids = std::set<std::string, std::less<>>;

  /// What the only alternative of a new document is called.
  static constexpr std::string_view first_alternative = "main";

  Entities entities;
  std::shared_ptr<const Ids> used_ids =
      std::make_shared<const Ids>();  ///< Alive or deleted: never given again.
  std::uint64_t next_shape = 1;       ///< One more than the largest N of a "shape-N" so far.
  /// In the order of making, the present one among them. An entity has its id in all of them; used_ids and
  /// next_shape are of all together.
  std::shared_ptr<const Alternatives> alternatives = std::make_shared<const Alternatives>(
      Alternatives{Alternative{std::string(first_alternative), nullptr}});
  std::size_t present = 0;  ///< Index of the alternative that is worked on.
  std::shared_ptr<const Versions> versions = std::make_shared<const Versions>();  ///< By name (U6).
  std::shared_ptr<const Comments> comments = std::make_shared<const Comments>();  ///< By id (U6).
  std::uint64_t next_comment = 1;  ///< More than the number of every comment.

  const std::string& present_alternative() const { return (*alternatives)[present].name; }

  /// Null when there is none of that id.
  EntityPtr find(std::string_view id) const;
  /// Null when there is none of that id, or it is not a dual shape.
  DualPtr find_dual(std::string_view id) const { return as_dual(find(id)); }
};

/// What differs between two documents, by identity of the entities: ids in ascending order.
struct Changes {
  std::vector<std::string> created, changed, removed;
  bool alternatives = false;  ///< Which there are, at which version, or which is the present one.
  bool versions = false;      ///< Named ones (U6).
  bool comments = false;
  bool empty() const {
    return created.empty() && changed.empty() && removed.empty() && !alternatives && !versions && !comments;
  }
  /// Created, changed and removed together, ascending.
  std::vector<std::string> all() const;
};
Changes difference(const Document& before, const Document& after);

class ProfileSolvers;

class SculptSolvers;

struct ApplyContext {
  Limits limits;
  /// What a gesture keeps from one evaluation of modify_profile to the next; null: nothing. No result depends
  /// on it.
  std::shared_ptr<ProfileSolvers> profile_solvers;
  /// How loops over many points run; no result depends on it.
  geometry::ParallelFor parallel = geometry::run_in_turn;
  /// Kept between operations, so that a drag never factorises; no result depends on it. Null: made each time.
  std::shared_ptr<SculptSolvers> sculpt_solvers;
  /// That the operation gets in the order of all, for the version that it names; 0: there is no order.
  std::uint64_t sequence = 0;
};

struct ApplyResult {
  Document document;
  Changes changes;
  handloft::v1::Operation
      effective;      ///< With ids and stroke numbers resolved: what the log stores, and replays alike.
  std::string words;  ///< For history: "Add 120 points to Top".
  std::vector<std::string> notes;  ///< Warnings for a person: degree lowered (A7), plane drifted (A10).
};

/// Applies one operation of the document. Undo, redo (Model) and export, and an import whose file has not
/// been read (session), are answered with failed_precondition. Any bytes that parse as an Operation may be
/// passed: bad ones are refused with the field's path, never crash and never leave NaN behind. Cost: O(size
/// of the operation), for fits O(points).
Result<ApplyResult> apply(const Document& document, const handloft::v1::Operation& operation,
                          const ApplyContext& context = {});

}  // namespace handloft::model
