#include "server-model/model/step_index.h"

#include <algorithm>
#include <iterator>
#include <string_view>
#include <utility>

namespace handloft::model {

namespace {

using Kind = Conflict::Kind;

/// What a key stands for; its first letter.
enum : char {
  entity_in = 'e',        ///< An entity of an alternative.
  id_given = 'i',         ///< An id, used for the first time.
  whole = 'w',            ///< An alternative, made or deleted.
  worked_in = 'k',        ///< An alternative in which entities were changed.
  present = 'p',          ///< Which alternative is worked on.
  version_of = 'a',       ///< The version that an alternative is at.
  version = 'v',          ///< A named version,
  named_version = 'n',    ///< something that names it,
  comment = 'c',          ///< a comment,
  answered_comment = 'r'  ///< an answer to it.
};

struct Key {
  std::string text;
  bool changes = true;  ///< The step has changed it.
  bool asks = true;     ///< Somebody's having changed it is in the step's way.
};

std::string text(char kind, std::string_view name, std::string_view id = {}) {
  std::string key;
  key.reserve(2 + name.size() + id.size());
  key += kind;
  key += name;
  if (kind == entity_in) {
    key += '\0';
    key += id;
  }
  return key;
}

/// Two steps have something in common (step_delta.h) when one asks for a key that the other changes. Calls
/// `visit` with each key once or more often.
template <typename Visit>
void each_key(const StepDelta& delta, const Visit& visit) {
  for (const auto& change : delta.entities) visit(Key{text(entity_in, delta.alternative, change.id)});
  for (const std::string& id : delta.ids) visit(Key{text(id_given, id)});
  // Work in an alternative is in the way of making and deleting it, not of other work there.
  if (!delta.entities.empty()) {
    visit(Key{text(worked_in, delta.alternative), true, false});
    visit(Key{text(whole, delta.alternative), false, true});
  }
  for (const auto* wholes : {&delta.made, &delta.deleted}) {
    for (const StepDelta::Whole& each : *wholes) {
      visit(Key{text(whole, each.alternative.name)});
      visit(Key{text(worked_in, each.alternative.name), false, true});
      if (!each.alternative.version.empty())
        visit(Key{text(named_version, each.alternative.version), true, false});
    }
  }
  if (delta.present_before != delta.present_after) visit(Key{text(present, {})});
  for (const StepDelta::At& at : delta.at) {
    visit(Key{text(version_of, at.alternative)});
    if (!at.after.empty()) visit(Key{text(named_version, at.after), true, false});
  }
  for (const auto& change : delta.versions) {
    visit(Key{text(version, change.id)});
    if (change.after && !change.after->parent.empty())
      visit(Key{text(named_version, change.after->parent), true, false});
  }
  for (const auto& change : delta.comments) {
    visit(Key{text(comment, change.id)});
    if (change.after && !change.after->reply_to.empty())
      visit(Key{text(answered_comment, change.after->reply_to), true, false});
  }
}

Conflict conflict_of(const std::string& key) {
  const std::string rest = key.substr(1);
  switch (key[0]) {
    case entity_in:
      return {Kind::entity, rest.substr(rest.find('\0') + 1)};
    case id_given:
      return {Kind::entity, rest};
    case present:
      return {Kind::present, {}};
    case version:
      return {Kind::version, rest};
    case comment:
      return {Kind::comment, rest};
    default:
      return {Kind::alternative, rest};
  }
}

/// Whose steps explain a conflict.
std::vector<std::string> keys_of(const Conflict& conflict, const std::string& alternative) {
  switch (conflict.kind) {
    case Kind::entity:
      return {text(entity_in, alternative, conflict.id), text(id_given, conflict.id)};
    case Kind::present:
      return {text(present, {})};
    case Kind::alternative:
      return {text(worked_in, conflict.id), text(whole, conflict.id), text(version_of, conflict.id)};
    case Kind::version:
      return {text(version, conflict.id), text(named_version, conflict.id)};
    case Kind::comment:
      return {text(comment, conflict.id), text(answered_comment, conflict.id)};
  }
  return {};
}

}  // namespace

void StepIndex::add(std::uint64_t number, const StepDelta& delta, bool undone) {
  each_key(delta, [&](Key key) {
    Touch& touch = touches_[std::move(key.text)];
    if (key.asks) ++touch.asking;
    if (!key.changes) return;
    // Ascending as a rule: at the end in O(1).
    std::set<std::uint64_t>& numbers = undone ? touch.undone : touch.standing;
    numbers.emplace_hint(numbers.end(), number);
  });
}

void StepIndex::set_undone(std::uint64_t number, const StepDelta& delta, bool undone) {
  each_key(delta, [&](const Key& key) {
    if (!key.changes) return;
    Touch& touch = touches_.at(key.text);
    (undone ? touch.standing : touch.undone).erase(number);
    (undone ? touch.undone : touch.standing).insert(number);
  });
}

void StepIndex::leave(std::uint64_t number, const StepDelta& delta, bool remembered) {
  each_key(delta, [&](const Key& key) {
    const auto found = touches_.find(key.text);
    if (found == touches_.end()) return;
    Touch& touch = found->second;
    if (key.asks) --touch.asking;
    if (key.changes) {
      touch.standing.erase(number);
      touch.undone.erase(number);
      if (remembered) touch.forgotten = std::max(touch.forgotten, number);
    }
    if (touch.asking == 0 && touch.standing.empty() && touch.undone.empty()) touches_.erase(found);
  });
}

void StepIndex::drop(std::uint64_t number, const StepDelta& delta) {
  leave(number, delta, false);
}

void StepIndex::forget(std::uint64_t number, const StepDelta& delta, bool undone) {
  leave(number, delta, !undone);
}

std::optional<StepIndex::Later> StepIndex::later(std::uint64_t number, const StepDelta& delta) const {
  std::optional<Later> newest;
  each_key(delta, [&](const Key& key) {
    if (!key.asks) return;
    const auto found = touches_.find(key.text);
    if (found == touches_.end()) return;
    const Touch& touch = found->second;
    const std::uint64_t standing = touch.standing.empty() ? 0 : *touch.standing.rbegin();
    const bool forgotten = touch.forgotten > standing;
    const std::uint64_t last = std::max(standing, touch.forgotten);
    if (last > number && (!newest || last > newest->number))
      newest = Later{last, forgotten, conflict_of(key.text)};
  });
  return newest;
}

std::uint64_t StepIndex::newest_standing(std::uint64_t number, const Conflict& conflict,
                                         const std::string& alternative) const {
  std::uint64_t newest = 0;
  for (const std::string& key : keys_of(conflict, alternative)) {
    const auto found = touches_.find(key);
    if (found != touches_.end() && !found->second.standing.empty())
      newest = std::max(newest, *found->second.standing.rbegin());
  }
  return newest > number ? newest : 0;
}

std::uint64_t StepIndex::newest_undone(const Conflict& conflict, const std::string& alternative,
                                       const std::function<bool(std::uint64_t)>& wanted) const {
  constexpr int looked_at = 64;
  std::uint64_t newest = 0;
  for (const std::string& key : keys_of(conflict, alternative)) {
    const auto found = touches_.find(key);
    if (found == touches_.end()) continue;
    int left = looked_at;
    const auto& undone = found->second.undone;
    for (auto each = undone.rbegin(); each != undone.rend() && left > 0; ++each, --left) {
      if (!wanted(*each)) continue;
      newest = std::max(newest, *each);
      break;
    }
  }
  return newest;
}

StepIndex::Forgotten StepIndex::forgotten_but(const std::vector<Kept>& kept) const {
  const auto is_kept = [&](std::uint64_t number) {
    const auto at = std::lower_bound(kept.begin(), kept.end(), number,
                                     [](const Kept& each, std::uint64_t key) { return each.number < key; });
    return at != kept.end() && at->number == number;
  };
  std::unordered_map<const Touch*, std::uint64_t> known;
  Forgotten forgotten;
  for (const Kept& each : kept) {
    each_key(*each.delta, [&](Key key) {
      if (!key.asks) return;
      const auto found = touches_.find(key.text);
      if (found == touches_.end()) return;
      const Touch& touch = found->second;
      const auto [at, is_new] = known.try_emplace(&touch, touch.forgotten);
      if (is_new) {
        const auto last = std::find_if(touch.standing.rbegin(), touch.standing.rend(),
                                       [&](std::uint64_t number) { return !is_kept(number); });
        if (last != touch.standing.rend()) at->second = std::max(at->second, *last);
      }
      if (at->second > each.number) forgotten.emplace(std::move(key.text), at->second);
    });
  }
  return forgotten;
}

void StepIndex::remember(const Forgotten& forgotten) {
  for (const auto& [key, number] : forgotten) {
    const auto found = touches_.find(key);
    if (found != touches_.end()) found->second.forgotten = std::max(found->second.forgotten, number);
  }
}

}  // namespace handloft::model
