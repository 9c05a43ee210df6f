#pragma once
// Which steps of a history have changed the same (U1): of everything that a step changes, the numbers of the
// steps that did. Answers in O(log n) per thing changed what looking at every step behind would: whether
// somebody has gone on since. A step that stands and is forgotten has still been made: nobody can take it
// back any more, and those before it that changed the same are in its way for ever.

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "server-model/model/step_delta.h"

namespace handloft::model {

class StepIndex {
 public:
  /// A step behind another one, which changed the same.
  struct Later {
    std::uint64_t number = 0;
    bool forgotten = false;
    Conflict what;
  };
  /// By what was changed (opaque text): the newest forgotten step that did.
  using Forgotten = std::map<std::string, std::uint64_t>;

  /// Numbers ascend in time, from 1; each is there once.
  void add(std::uint64_t number, const StepDelta& delta, bool undone);
  void set_undone(std::uint64_t number, const StepDelta& delta, bool undone);
  /// It is as if it had never been.
  void drop(std::uint64_t number, const StepDelta& delta);
  /// Nobody can undo or redo it any more. Where it stands, later() still finds it.
  void forget(std::uint64_t number, const StepDelta& delta, bool undone);

  /// The newest step behind this one that stands and changed what this one did (step_delta.h: in_common()).
  std::optional<Later> later(std::uint64_t number, const StepDelta& delta) const;
  /// The newest behind `number` that stands and touches what is in the way (in this alternative); 0: none, or
  /// it is forgotten.
  std::uint64_t newest_standing(std::uint64_t number, const Conflict& conflict,
                                const std::string& alternative) const;
  /// The newest that is taken back, touches what is in the way, and is `wanted`; 0: none. Of each thing the
  /// newest 64 are looked at.
  std::uint64_t newest_undone(const Conflict& conflict, const std::string& alternative,
                              const std::function<bool(std::uint64_t)>& wanted) const;

  /// What later() must know of forgotten steps when of those here only these are kept, which ascend.
  struct Kept {
    std::uint64_t number = 0;
    const StepDelta* delta = nullptr;
  };
  Forgotten forgotten_but(const std::vector<Kept>& kept) const;
  /// From another index's forgotten_but(); of what no step here has changed nothing is remembered.
  void remember(const Forgotten& forgotten);

 private:
  struct Touch {
    std::set<std::uint64_t> standing, undone;  ///< Steps that have changed it.
    std::size_t asking = 0;                    ///< Steps that somebody's having changed it is in the way of.
    std::uint64_t forgotten = 0;               ///< The newest of those that stood; 0: none.
  };
  void leave(std::uint64_t number, const StepDelta& delta, bool remembered);

  std::unordered_map<std::string, Touch> touches_;
};

}  // namespace handloft::model
