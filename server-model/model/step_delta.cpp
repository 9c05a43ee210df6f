#include "server-model/model/step_delta.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <iterator>
#include <utility>

namespace handloft::model {

namespace {

using EntitiesPtr = std::shared_ptr<const Entities>;

const Alternative* find(const Alternatives& alternatives, std::string_view name) {
  const auto found = std::find_if(alternatives.begin(), alternatives.end(),
                                  [&](const Alternative& each) { return each.name == name; });
  return found == alternatives.end() ? nullptr : &*found;
}

/// What an alternative holds, the present one among them.
const Entities& content(const Document& document, const Alternative& alternative) {
  return alternative.entities ? *alternative.entities : document.entities;
}

template <typename Value, typename Map>
void add_changes(const Map& before, const Map& after, std::vector<StepDelta::Change<Value>>& to) {
  auto a = before.begin();
  auto b = after.begin();
  while (a != before.end() || b != after.end()) {
    if (b == after.end() || (a != before.end() && a->first < b->first)) {
      to.push_back({a->first, a->second, nullptr});
      ++a;
    } else if (a == before.end() || b->first < a->first) {
      to.push_back({b->first, nullptr, b->second});
      ++b;
    } else {
      if (a->second != b->second) to.push_back({a->first, a->second, b->second});
      ++a;
      ++b;
    }
  }
}

void add_wholes(const Document& of, const Document& not_in, std::vector<StepDelta::Whole>& to) {
  for (std::size_t i = 0; i < of.alternatives->size(); ++i) {
    const Alternative& each = (*of.alternatives)[i];
    if (find(*not_in.alternatives, each.name) != nullptr) continue;
    StepDelta::Whole& whole = to.emplace_back();
    whole.place = i;
    whole.alternative = each;
    if (!each.entities) whole.alternative.entities = std::make_shared<const Entities>(of.entities);
  }
}

/// The three states that a step goes between, seen in one direction.
struct Ends {
  explicit Ends(const StepDelta& delta, Direction direction)
      : delta_(delta), back_(direction == Direction::back) {}

  template <typename Change>
  const auto& from(const Change& change) const {
    return back_ ? change.after : change.before;
  }
  template <typename Change>
  const auto& to(const Change& change) const {
    return back_ ? change.before : change.after;
  }
  const std::string& present_from() const { return back_ ? delta_.present_after : delta_.present_before; }
  const std::string& present_to() const { return back_ ? delta_.present_before : delta_.present_after; }
  const std::vector<StepDelta::Whole>& vanishing() const { return back_ ? delta_.made : delta_.deleted; }
  const std::vector<StepDelta::Whole>& coming() const { return back_ ? delta_.deleted : delta_.made; }
  std::uint64_t next_shape_from() const { return back_ ? delta_.next_shape_after : delta_.next_shape_before; }
  std::uint64_t next_shape_to() const { return back_ ? delta_.next_shape_before : delta_.next_shape_after; }
  std::uint64_t next_comment_from() const {
    return back_ ? delta_.next_comment_after : delta_.next_comment_before;
  }
  std::uint64_t next_comment_to() const {
    return back_ ? delta_.next_comment_before : delta_.next_comment_after;
  }
  bool changes_present() const { return delta_.present_before != delta_.present_after; }

 private:
  const StepDelta& delta_;
  bool back_;
};

template <typename Map>
typename Map::mapped_type value(const Map& map, std::string_view id) {
  const auto found = map.find(id);
  return found == map.end() ? nullptr : found->second;
}

using Kind = Conflict::Kind;

/// What names something that is no longer there.
std::optional<Conflict> dangling(const Document& document) {
  const auto is_version = [&](const std::string& name) {
    return name.empty() || document.versions->contains(name);
  };
  for (const Alternative& each : *document.alternatives) {
    if (!is_version(each.version)) return Conflict{Kind::version, each.version};
  }
  for (const auto& [name, version] : *document.versions) {
    if (!is_version(version->parent)) return Conflict{Kind::version, version->parent};
  }
  for (const auto& [id, comment] : *document.comments) {
    if (!comment->reply_to.empty() && !document.comments->contains(comment->reply_to))
      return Conflict{Kind::comment, comment->reply_to};
  }
  return std::nullopt;
}

std::optional<Conflict> alternatives_conflict(const Document& current, const StepDelta& delta,
                                              const Ends& ends) {
  const std::string& present = current.present_alternative();
  if (ends.changes_present() && present != ends.present_from()) return Conflict{Kind::present, {}};
  for (const StepDelta::Whole& whole : ends.vanishing()) {
    const Alternative* const there = find(*current.alternatives, whole.alternative.name);
    if (there == nullptr || there->version != whole.alternative.version ||
        content(current, *there) != *whole.alternative.entities) {
      return Conflict{Kind::alternative, whole.alternative.name};
    }
    if (present == whole.alternative.name && !ends.changes_present()) return Conflict{Kind::present, {}};
  }
  for (const StepDelta::Whole& whole : ends.coming()) {
    if (find(*current.alternatives, whole.alternative.name) != nullptr)
      return Conflict{Kind::alternative, whole.alternative.name};
  }
  if (ends.changes_present() && find(*current.alternatives, ends.present_to()) == nullptr &&
      std::none_of(ends.coming().begin(), ends.coming().end(), [&](const StepDelta::Whole& whole) {
        return whole.alternative.name == ends.present_to();
      })) {
    return Conflict{Kind::alternative, ends.present_to()};
  }
  for (const StepDelta::At& at : delta.at) {
    const Alternative* const there = find(*current.alternatives, at.alternative);
    if (there == nullptr || there->version != ends.from(at))
      return Conflict{Kind::alternative, at.alternative};
  }
  return std::nullopt;
}

void step_alternatives(Document& document, const StepDelta& delta, const Ends& ends) {
  if (delta.made.empty() && delta.deleted.empty() && delta.at.empty() && !ends.changes_present()) return;
  auto alternatives = std::make_shared<Alternatives>(*document.alternatives);
  const std::string present = ends.changes_present() ? ends.present_to() : document.present_alternative();
  const bool switches = present != document.present_alternative();
  if (switches)
    (*alternatives)[document.present].entities = std::make_shared<const Entities>(document.entities);
  for (const StepDelta::Whole& whole : ends.vanishing()) {
    alternatives->erase(
        std::remove_if(alternatives->begin(), alternatives->end(),
                       [&](const Alternative& each) { return each.name == whole.alternative.name; }),
        alternatives->end());
  }
  for (const StepDelta::Whole& whole : ends.coming()) {
    const std::size_t place = std::min(whole.place, alternatives->size());
    alternatives->insert(alternatives->begin() + static_cast<std::ptrdiff_t>(place), whole.alternative);
  }
  for (std::size_t i = 0; i < alternatives->size(); ++i) {
    Alternative& each = (*alternatives)[i];
    for (const StepDelta::At& at : delta.at) {
      if (at.alternative == each.name) each.version = ends.to(at);
    }
    if (each.name != present) continue;
    document.present = i;
    if (!switches) continue;
    document.entities = *each.entities;
    each.entities = nullptr;
  }
  document.alternatives = std::move(alternatives);
}

template <typename Value, typename Map>
void step_map(const std::vector<StepDelta::Change<Value>>& changes, const Ends& ends, Map& map) {
  for (const auto& change : changes) {
    if (const Value& value = ends.to(change)) {
      map.insert_or_assign(change.id, value);
    } else {
      map.erase(change.id);
    }
  }
}

template <typename Value, typename Map>
void step_shared(const std::vector<StepDelta::Change<Value>>& changes, const Ends& ends,
                 std::shared_ptr<const Map>& map) {
  if (changes.empty()) return;
  auto next = std::make_shared<Map>(*map);
  step_map(changes, ends, *next);
  map = std::move(next);
}

// Copying the set costs: only where it changes.
void step_given(Document& document, const StepDelta& delta, const Ends& ends, Direction direction) {
  if (!delta.ids.empty()) {
    auto ids = std::make_shared<Document::Ids>(*document.used_ids);
    for (const std::string& id : delta.ids) {
      if (direction == Direction::forth) {
        ids->insert(id);
      } else {
        ids->erase(id);
      }
    }
    document.used_ids = std::move(ids);
  }
  const auto step = [&](std::uint64_t to, std::uint64_t& counter) {
    counter = direction == Direction::forth ? std::max(counter, to) : to;
  };
  if (ends.next_shape_from() != ends.next_shape_to()) step(ends.next_shape_to(), document.next_shape);
  if (ends.next_comment_from() != ends.next_comment_to()) step(ends.next_comment_to(), document.next_comment);
}

template <typename Changes>
bool changes_id(const Changes& changes, const std::string& id) {
  const auto at =
      std::lower_bound(changes.begin(), changes.end(), id,
                       [](const auto& change, const std::string& key) { return change.id < key; });
  return at != changes.end() && at->id == id;
}

template <typename Wholes>
const StepDelta::Whole* whole_of(const Wholes& wholes, const std::string& name) {
  for (const StepDelta::Whole& whole : wholes) {
    if (whole.alternative.name == name) return &whole;
  }
  return nullptr;
}

}  // namespace

StepDelta delta_between(const Document& before, const Document& after) {
  StepDelta delta;
  for (const Alternative& was : *before.alternatives) {
    const Alternative* const is = find(*after.alternatives, was.name);
    if (is == nullptr) continue;
    if (was.version != is->version) delta.at.push_back({was.name, was.version, is->version});
    if (was.entities && was.entities == is->entities) continue;
    const std::size_t known = delta.entities.size();
    add_changes(content(before, was), content(after, *is), delta.entities);
    if (delta.entities.size() > known) delta.alternative = was.name;
  }
  if (before.alternatives != after.alternatives) {
    add_wholes(after, before, delta.made);
    add_wholes(before, after, delta.deleted);
  }
  delta.present_before = before.present_alternative();
  delta.present_after = after.present_alternative();
  if (before.versions != after.versions) add_changes(*before.versions, *after.versions, delta.versions);
  if (before.comments != after.comments) add_changes(*before.comments, *after.comments, delta.comments);
  if (before.used_ids != after.used_ids) {
    std::set_difference(after.used_ids->begin(), after.used_ids->end(), before.used_ids->begin(),
                        before.used_ids->end(), std::back_inserter(delta.ids));
  }
  delta.next_shape_before = before.next_shape;
  delta.next_shape_after = after.next_shape;
  delta.next_comment_before = before.next_comment;
  delta.next_comment_after = after.next_comment;
  return delta;
}

std::optional<Conflict> conflict(const Document& current, const StepDelta& delta, Direction direction) {
  const Ends ends(delta, direction);
  if (!delta.entities.empty() && current.present_alternative() != delta.alternative)
    return Conflict{Kind::present, {}};
  for (const auto& change : delta.entities) {
    if (value(current.entities, change.id) != ends.from(change)) return Conflict{Kind::entity, change.id};
  }
  for (const auto& change : delta.versions) {
    if (value(*current.versions, change.id) != ends.from(change)) return Conflict{Kind::version, change.id};
  }
  for (const auto& change : delta.comments) {
    if (value(*current.comments, change.id) != ends.from(change)) return Conflict{Kind::comment, change.id};
  }
  if (auto found = alternatives_conflict(current, delta, ends)) return found;
  const bool only_entities = delta.made.empty() && delta.deleted.empty() && delta.at.empty() &&
                             delta.versions.empty() && delta.comments.empty();
  return only_entities ? std::nullopt : dangling(stepped(current, delta, direction, Given::kept));
}

Document stepped(const Document& current, const StepDelta& delta, Direction direction, Given given) {
  const Ends ends(delta, direction);
  Document next = current;
  step_map(delta.entities, ends, next.entities);
  step_shared(delta.versions, ends, next.versions);
  step_shared(delta.comments, ends, next.comments);
  step_alternatives(next, delta, ends);
  if (direction == Direction::forth || given == Given::freed) step_given(next, delta, ends, direction);
  return next;
}

std::optional<StepDelta> placed(const Document& current, const StepDelta& delta, Direction direction) {
  std::optional<StepDelta> moved;
  const auto wholes = direction == Direction::back ? &StepDelta::made : &StepDelta::deleted;
  for (std::size_t i = 0; i < (delta.*wholes).size(); ++i) {
    const StepDelta::Whole& whole = (delta.*wholes)[i];
    const Alternative* const there = find(*current.alternatives, whole.alternative.name);
    if (there == nullptr) continue;
    const auto place = static_cast<std::size_t>(there - current.alternatives->data());
    if (place == whole.place) continue;
    if (!moved) moved = delta;
    ((*moved).*wholes)[i].place = place;
  }
  return moved;
}

namespace {

template <typename Changes>
std::optional<std::string> common_id(const Changes& a, const Changes& b) {
  const bool longer = a.size() > b.size();
  const Changes& few = longer ? b : a;
  const Changes& many = longer ? a : b;
  for (const auto& change : few) {
    if (changes_id(many, change.id)) return change.id;
  }
  return std::nullopt;
}

/// One of them made or deleted what the other one worked on, made or deleted.
std::optional<std::string> common_whole(const StepDelta& a, const StepDelta& b) {
  for (const auto* wholes : {&a.made, &a.deleted}) {
    for (const StepDelta::Whole& whole : *wholes) {
      const std::string& name = whole.alternative.name;
      if ((!b.entities.empty() && b.alternative == name) || whole_of(b.made, name) != nullptr ||
          whole_of(b.deleted, name) != nullptr) {
        return name;
      }
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<Conflict> in_common(const StepDelta& a, const StepDelta& b) {
  if (a.alternative == b.alternative) {
    if (auto id = common_id(a.entities, b.entities)) return Conflict{Kind::entity, *id};
  }
  for (const std::string& id : a.ids) {
    if (std::binary_search(b.ids.begin(), b.ids.end(), id)) return Conflict{Kind::entity, id};
  }
  if (auto name = common_whole(a, b)) return Conflict{Kind::alternative, *name};
  if (auto name = common_whole(b, a)) return Conflict{Kind::alternative, *name};
  if (a.present_before != a.present_after && b.present_before != b.present_after)
    return Conflict{Kind::present, {}};
  for (const StepDelta::At& at : a.at) {
    for (const StepDelta::At& other : b.at) {
      if (at.alternative == other.alternative) return Conflict{Kind::alternative, at.alternative};
    }
  }
  if (auto id = common_id(a.versions, b.versions)) return Conflict{Kind::version, *id};
  if (auto id = common_id(a.comments, b.comments)) return Conflict{Kind::comment, *id};
  return std::nullopt;
}

std::string describe(const Conflict& conflict, const StepDelta& delta) {
  switch (conflict.kind) {
    case Kind::entity: {
      for (const auto& change : delta.entities) {
        if (change.id == conflict.id)
          return fmt::format("\"{}\"", (change.after ? change.after : change.before)->name);
      }
      return fmt::format("\"{}\"", conflict.id);
    }
    case Kind::present:
      return "which alternative is worked on";
    case Kind::alternative:
      return fmt::format("the alternative \"{}\"", conflict.id);
    case Kind::version:
      return fmt::format("the version \"{}\"", conflict.id);
    case Kind::comment:
      return fmt::format("the comment \"{}\"", conflict.id);
  }
  return {};
}

}  // namespace handloft::model
