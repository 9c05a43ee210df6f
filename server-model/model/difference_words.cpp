#include "server-model/model/difference_words.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server-model/model/annotations.h"
#include "server-model/model/comparison.h"
#include "server-model/model/operations/operations.h"
#include "server-model/model/reference_shape.h"
#include "server-model/model/sculpt_shape.h"

namespace handloft::model {

namespace v1 = handloft::v1;
using geometry::Vec3;

namespace {

/// Below it two lengths are the same: rounding of motions there and back.
constexpr double same_m = 1e-9;
constexpr double same_rad = 1e-9;

/// One thing that became of an entity.
struct Fact {
  enum class Kind : std::uint8_t {
    made,
    deleted,
    renamed,
    moved,
    points,
    points_moved,
    fitted,
    trimmed,
    symmetry,
    shown,
    sculpted,
    icons,
    yields,
    mesh,
    other
  };
  Kind kind;
  std::string active;   ///< Behind "Ann ": "moved seat by 12 mm"
  std::string passive;  ///< "seat was moved by 12 mm"
};

std::string length(double metres) {
  const double mm = 1e3 * metres;
  if (metres >= 1) return fmt::format("{:.2f} m", metres);
  if (mm >= 10) return fmt::format("{:.0f} mm", mm);
  if (mm >= 0.1) return fmt::format("{:.1f} mm", mm);
  return fmt::format("{:.2g} mm", mm);
}

std::string points(std::size_t count) {
  return fmt::format("{} point{}", count, count == 1 ? "" : "s");
}

class Facts {
 public:
  Facts(EntityPtr then, EntityPtr now) : then_(std::move(then)), now_(std::move(now)) {
    name_ = (now_ ? now_ : then_)->name;
    if (!then_) {
      add(Fact::Kind::made, fmt::format("made {}", name_), fmt::format("{} was made", name_));
      return;
    }
    if (!now_) {
      add(Fact::Kind::deleted, fmt::format("deleted {}", name_), fmt::format("{} was deleted", name_));
      return;
    }
    if (then_->name != now_->name) {
      add(Fact::Kind::renamed, fmt::format("renamed {} to {}", then_->name, name_),
          fmt::format("{} was renamed to {}", then_->name, name_));
    }
    add_motion();
    if (const DualPtr shape = as_dual(now_), former = as_dual(then_); shape && former)
      add_dual(*shape, *former);
    if (const SculptPtr surface = as_sculpt(now_), former = as_sculpt(then_); surface && former)
      add_sculpt(*surface, *former);
    if (const ReferencePtr mesh = as_reference(now_), former = as_reference(then_);
        mesh && former && mesh->mesh != former->mesh) {
      add(Fact::Kind::mesh, fmt::format("replaced the mesh of {}", name_),
          fmt::format("the mesh of {} was replaced", name_));
    }
    if (facts_.empty())
      add(Fact::Kind::other, fmt::format("changed {}", name_), fmt::format("{} was changed", name_));
  }

  const std::vector<Fact>& all() const { return facts_; }
  bool has(Fact::Kind kind) const {
    return std::any_of(facts_.begin(), facts_.end(), [&](const Fact& fact) { return fact.kind == kind; });
  }

 private:
  void add(Fact::Kind kind, std::string active, std::string passive) {
    facts_.push_back({kind, std::move(active), std::move(passive)});
  }
  /// "trimmed seat", "seat was trimmed"
  void add_done(Fact::Kind kind, const char* done, const std::string& behind = {}) {
    add(kind, fmt::format("{} {}{}", done, name_, behind), fmt::format("{} was {}{}", name_, done, behind));
  }

  void add_motion() {
    if (same_motion(then_->motion, now_->motion)) return;
    const Similarity now = now_->motion ? *now_->motion : Similarity();
    since_ = then_->motion ? now.after(then_->motion->inverse()) : now;
    if (!since_.finite()) since_ = Similarity();
    const Vec3 centre = centre_of(then_);
    const double shift = (since_(centre) - centre).norm();
    if (shift > same_m) add_done(Fact::Kind::moved, "moved", " by " + length(shift));
    const double angle = 2 * std::atan2(since_.rotation.vec().norm(), std::abs(since_.rotation.w()));
    if (angle > same_rad) {
      constexpr double degrees = 180 / 3.14159265358979323846;
      add_done(Fact::Kind::moved, "turned", fmt::format(" by {:.3g} degrees", degrees * angle));
    }
    if (std::abs(since_.scale - 1) > same_rad)
      add_done(Fact::Kind::moved, "scaled", fmt::format(" to {:.4g} %", 100 * since_.scale));
  }

  void add_dual(const DualShape& now, const DualShape& then) {
    const std::size_t more = now.points.size(), fewer = then.points.size();
    if (more > fewer) {
      add(Fact::Kind::points, fmt::format("added {} to {}", points(more - fewer), name_),
          fmt::format("{} {} added to {}", points(more - fewer), more - fewer == 1 ? "was" : "were", name_));
    }
    if (fewer > more) {
      add(Fact::Kind::points, fmt::format("deleted {} of {}", points(fewer - more), name_),
          fmt::format("{} {} deleted of {}", points(fewer - more), fewer - more == 1 ? "was" : "were",
                      name_));
    }
    double most = 0;
    for (std::size_t i = 0; more >= fewer && i < fewer; ++i)
      most = std::max(most, (now.points[i].position() - since_(then.points[i].position())).norm());
    if (most > same_m) add_changed(Fact::Kind::points_moved, "points of ", most);
    if (!now.fit != !then.fit) {
      if (now.fit) {
        add(Fact::Kind::fitted, fmt::format("fitted a surface to {}", name_),
            fmt::format("a surface was fitted to {}", name_));
      } else {
        add(Fact::Kind::fitted, fmt::format("took the surface of {} away", name_),
            fmt::format("the surface of {} was taken away", name_));
      }
    } else if (now.fit != then.fit && fitted_again(*now.fit, *then.fit)) {
      add_done(Fact::Kind::fitted, "fitted", " again");
    }
    if (now.superellipse_exponent != then.superellipse_exponent ||
        (now.boundary != then.boundary &&
         (!now.boundary || !then.boundary || same_motion(now.motion, then.motion))))
      add_done(Fact::Kind::trimmed, "trimmed", " otherwise");
    if (now.symmetry != then.symmetry || now.partner != then.partner) {
      add(Fact::Kind::symmetry, fmt::format("changed the symmetry of {}", name_),
          fmt::format("the symmetry of {} was changed", name_));
    }
    // A first fit shows the surface, and losing it the points.
    if (now.representation != then.representation && !now.fit == !then.fit) {
      add(Fact::Kind::shown, fmt::format("changed how {} is shown", name_),
          fmt::format("how {} is shown was changed", name_));
    }
  }

  /// A motion keeps the scaled coefficients, or scales them (transform.h).
  bool fitted_again(const FittedSurface& now, const FittedSurface& then) const {
    const auto a = now.surface.scaled_coefficients();
    const auto b = then.surface.scaled_coefficients();
    if (a.size() != b.size() || now.residuals_m.size() != then.residuals_m.size()) return true;
    for (std::size_t i = 0; i < a.size(); ++i) {
      if (std::abs(a[i] - since_.scale * b[i]) > same_m) return true;
    }
    return false;
  }

  void add_sculpt(const SculptShape& now, const SculptShape& then) {
    if (now.surface != then.surface) {
      const std::vector<Vec3>&a = now.surface->control, &b = then.surface->control;
      double most = 0;
      for (std::size_t i = 0; a.size() == b.size() && i < a.size(); ++i)
        most = std::max(most, (a[i] - since_(b[i])).norm());
      if (a.size() != b.size())
        add_done(Fact::Kind::sculpted, "refined", fmt::format(" to {} control points", a.size()));
      if (most > same_m) add_done(Fact::Kind::sculpted, "sculpted", " by up to " + length(most));
    }
    if (now.icons->size() != then.icons->size()) {
      add(Fact::Kind::icons, fmt::format("changed the icons of {}", name_),
          fmt::format("the icons of {} were changed", name_));
    }
    if (now.supports != then.supports || now.absolute != then.absolute ||
        now.least_squares != then.least_squares ||
        (now.energy != then.energy && same_motion(now.motion, then.motion))) {
      add(Fact::Kind::yields, fmt::format("changed how {} yields", name_),
          fmt::format("how {} yields was changed", name_));
    }
  }

  void add_changed(Fact::Kind kind, const char* what, double most) {
    add(kind, fmt::format("moved {}{} by up to {}", what, name_, length(most)),
        fmt::format("{}{} were moved by up to {}", what, name_, length(most)));
  }

  EntityPtr then_, now_;
  std::string name_;
  Similarity since_;  ///< What has moved it as a whole in between.
  std::vector<Fact> facts_;
};

/// The steps that changed one entity, in between.
struct Work {
  const StepInfo* info;
  const StepDelta::Change<EntityPtr>* change;
};

/// Two sides of a comparison.
struct Side {
  std::string alternative;
  std::shared_ptr<const Entities> entities;
  std::uint64_t sequence = std::numeric_limits<std::uint64_t>::max();
};

std::vector<Work> work_on(const std::string& entity, const Side& from, const Side& to,
                          const History& history) {
  std::vector<Work> work;
  // The step that named the version is still known, so all after it are.
  if (history.entries().empty() || history.entries().front().step->info.sequence > from.sequence ||
      history.forgotten_sequence() > from.sequence)
    return work;
  for (const History::Entry& entry : history.entries()) {
    const StepInfo& info = entry.step->info;
    const StepDelta& delta = entry.step->delta;
    if (entry.undone || info.sequence <= from.sequence || info.sequence > to.sequence ||
        delta.alternative != to.alternative)
      continue;
    const auto at = std::lower_bound(
        delta.entities.begin(), delta.entities.end(), entity,
        [](const StepDelta::Change<EntityPtr>& change, const std::string& id) { return change.id < id; });
    if (at != delta.entities.end() && at->id == entity) work.push_back({&info, &*at});
  }
  return work;
}

void add_name(std::vector<std::string>& names, const StepInfo& info) {
  std::string name = who(info.author, info.client_id);
  if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(std::move(name));
}

/// Those who did it, in the order of their first step. Who has changed anything at all of the entity, when
/// there are too many steps to look at each.
std::vector<std::string> doers(const Fact& fact, const std::vector<Work>& work) {
  constexpr std::size_t max_looked_at = 200;
  std::vector<std::string> all;
  for (const Work& each : work) add_name(all, *each.info);
  if (all.size() <= 1 || work.size() > max_looked_at) return all;
  std::vector<std::string> names;
  for (const Work& each : work) {
    if (Facts(each.change->before, each.change->after).has(fact.kind)) add_name(names, *each.info);
  }
  return names.empty() ? all : names;
}

std::string sentence(const Fact& fact, const std::vector<std::string>& names) {
  std::string words = fact.passive;
  if (!names.empty()) {
    words = names.front();
    for (std::size_t i = 1; i < names.size(); ++i)
      words += (i + 1 == names.size() ? " and " : ", ") + names[i];
    words += " " + fact.active;
  }
  return words + ".";
}

Result<Side> side(const std::string& version, const Document& document, const char* field) {
  auto found = require_version(document, version, field);
  if (!found) return found.error();
  return Side{(*found)->alternative, (*found)->entities, (*found)->sequence};
}

EntityPtr find(const Entities& entities, const std::string& id) {
  const auto found = entities.find(id);
  return found == entities.end() ? nullptr : found->second;
}

}  // namespace

Result<v1::QueryResult> difference_in_words(const v1::DifferenceQuery& query, const Document& document,
                                            const History& history) {
  auto from = side(query.from(), document, "difference.from");
  if (!from) return from.error();
  Side to;
  if (query.to().empty()) {
    to.alternative = document.present_alternative();
    to.entities = std::make_shared<const Entities>(document.entities);
  } else {
    auto named = side(query.to(), document, "difference.to");
    if (!named) return named.error();
    to = *std::move(named);
  }
  v1::QueryResult result;
  v1::DifferenceResult& out = *result.mutable_difference();
  for (v1::EntityDifference& each : compare_entities(*to.entities, *from->entities)) {
    const std::vector<Work> work = work_on(each.entity(), *from, to, history);
    const Facts facts(find(*from->entities, each.entity()), find(*to.entities, each.entity()));
    for (const Fact& fact : facts.all()) out.add_sentences(sentence(fact, doers(fact, work)));
    *out.add_differences() = std::move(each);
  }
  return result;
}

}  // namespace handloft::model
