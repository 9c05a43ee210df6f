#pragma once
// What the gestures of one source of hands share (the server's own tracking, or a client): the model, the
// modes that the palette sets, and which shape is meant. And what all sources share: what each keeps to
// itself for as long as a gesture lasts (U1: leases that end by themselves).

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "common/base/table_palette.h"
#include "proto/operation.pb.h"
#include "server-model/interaction/icon_finder.h"
#include "server-model/interaction/leases.h"
#include "server-model/interaction/options.h"
#include "server-model/interaction/target.h"
#include "server-model/model/model.h"

namespace handloft::interaction {

/// Set from the palette, told to viewers.
struct Modes {
  StrokeSymmetry symmetry = StrokeSymmetry::off;
  TrimMode trim = TrimMode::profile;
  HandTool tool = HandTool::sculpt;
  bool keep_curve = false;  ///< Profile strokes leave points behind (A20).
  /// How pushes spread where the ranges of several contacts meet (A17).
  v1::Falloff falloff = v1::FALLOFF_LITERAL;
  /// Of fits and new shapes from now on; nullopt: as each shape is. 0: chosen by the model.
  std::optional<std::uint32_t> degree;
  int palette_page = first_palette_page;  ///< That the table shows.
  IconPen icon_pen = IconPen::point_or_curve;
  v1::IconRole icon_role = v1::ICON_CONSTRAINT;        ///< Of icons from now on.
  v1::IconProperty icon_property = v1::ICON_POSITION;  ///< Of points that constrain, from now on.
};

/// Of all hands on one model: while one has it, no other takes it.
struct Claims {
  std::set<IconName> icons;              ///< Driven now.
  std::multiset<std::string> shape_ids;  ///< Of shapes that strokes in the air are about to make.
  Leases leases = Leases();              ///< Of what gestures deform, or clients asked for.
};
using ClaimsPtr = std::shared_ptr<Claims>;

struct Workbench {
  /// `model` must outlive it; `claims_of_all` is not null. `client`: whose hands they are; 0: those that the
  /// server's own tracking follows.
  Workbench(model::Model& model_of, const InteractionOptions& given,
            ClaimsPtr claims_of_all = std::make_shared<Claims>(), std::uint64_t client = 0)
      : model(model_of),
        client_id(client),
        options(given),
        targets(given.reach_m),
        icons(given.reach_m),
        claims(std::move(claims_of_all)) {}

  model::Model& model;
  std::uint64_t client_id;  ///< In each operation of theirs.
  InteractionOptions options;
  Modes modes;
  TargetFinder targets;
  IconFinder icons;
  std::string selected;  ///< Chosen from the palette or by a peer; empty: none.
  std::string active;    ///< What a gesture acted on last; empty: the next stroke makes a new shape.
  ClaimsPtr claims;
  IconName picked_icon;     ///< What a hand picked or made last; see selected_icon().
  std::set<IconName> held;  ///< Those of `claims` that a hand or the 3D mouse of this source drives now.

  /// What strokes and the palette act on: the selected shape, else the one that a gesture acted on last;
  /// empty when there is none, or it is gone (an undo takes it away, a redo brings it back).
  std::string active_shape() const {
    for (const std::string& id : {selected, active}) {
      if (model.document().find(id)) return id;
    }
    return {};
  }
  /// The selected shape while it is there.
  std::string selected_shape() const { return model.document().find(selected) ? selected : std::string(); }
  /// What the palette's icon cells and the 3D mouse act on; empty: none, or it is gone.
  IconName selected_icon() const {
    return find_icon(model.document(), picked_icon) != nullptr ? picked_icon : IconName();
  }
  /// Selects an icon; what acts on whole surfaces acts on its one.
  void select_icon(const IconName& name) {
    picked_icon = name;
    active = name.entity;
    if (!selected.empty()) selected = name.entity;
  }
  /// The sculpted surface that commands act on: the selected icon's, else the active one; null: none.
  model::SculptPtr sculpted() const {
    const IconName icon = selected_icon();
    return model::as_sculpt(model.document().find(icon.empty() ? active_shape() : icon.entity));
  }
  /// What hands would act on with nothing selected: the shape or sculpted surface nearest to the way from..to
  /// that the hand's place has gone since the last frame; empty: none within reach.
  std::string nearest_entity(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    auto near = targets.nearest(model.document(), from, to);
    auto sculpted = icons.nearest_surface(model.document(), to);
    if (near && !(sculpted && sculpted->distance_m < near->distance_m)) return std::move(near->entity);
    return sculpted ? std::move(sculpted->entity) : std::string();
  }
  /// Its surface follows its points while they change: it is fitted, and points and surface are both shown.
  bool fits_live(const std::string& entity) const {
    const model::DualPtr shape = model.document().find_dual(entity);
    return shape && shape->fitted() && shape->representation == model::Representation::both;
  }
};

/// Keeps an icon to oneself for as long as it lives.
class IconHold {
 public:
  /// `workbench` must outlive it.
  explicit IconHold(Workbench& workbench) : workbench_(workbench) {}
  ~IconHold() { release(); }
  IconHold(const IconHold&) = delete;
  IconHold& operator=(const IconHold&) = delete;

  /// False: somebody else has it. What was held before is released.
  bool take(const IconName& name) {
    release();
    if (!workbench_.claims->icons.insert(name).second) return false;
    workbench_.held.insert(name);
    name_ = name;
    return true;
  }
  void release() {
    // Else it has lapsed (Interaction::lapse()), and may be somebody else's by now.
    if (workbench_.held.erase(name_) > 0) workbench_.claims->icons.erase(name_);
    name_ = IconName();
  }
  /// With every frame. False: it has lapsed, and somebody else has it now.
  bool renew() {
    if (name_.empty() || workbench_.held.contains(name_)) return true;
    return take(IconName(name_));
  }
  const IconName& name() const { return name_; }  ///< Empty: nothing.

 private:
  Workbench& workbench_;
  IconName name_;
};

}  // namespace handloft::interaction
