#pragma once
// A sheet to be sculpted by hand: 0.4 x 0.3 m at z = 0.1, its sides clamped.

#include <algorithm>
#include <string>
#include <vector>

#include "server-model/model/sculpt_shape.h"
#include "tests/unit/server-model/interaction/interaction_fixture.h"

namespace handloft::interaction {

class SculptTest : public GestureTest {
 protected:
  static constexpr double sheet_z = 0.1;

  void SetUp() override { make_sheet("sheet", {0, 0, sheet_z}); }

  void make_sheet(const std::string& id, const Vector3d& centre) {
    v1::Operation operation;
    v1::CreateSculptSurface& create = *operation.mutable_create_sculpt_surface();
    create.set_id(id);
    set_vec3(*create.mutable_rectangle()->mutable_pose()->mutable_position(), centre);
    create.mutable_rectangle()->set_width_m(0.4);
    create.mutable_rectangle()->set_depth_m(0.3);
    create.set_control_u(14);
    create.set_control_v(12);
    submit(operation);
  }
  void add_icon(const std::string& id, const std::vector<Vector3d>& places,
                v1::IconShape shape = v1::ICON_POINT, v1::IconState state = v1::ICON_DRIVING,
                const std::vector<std::string>& sensors = {}, v1::IconRole role = v1::ICON_CONSTRAINT) {
    v1::Operation operation;
    v1::AddIcon& add = *operation.mutable_add_icon();
    add.set_entity("sheet");
    add.set_id(id);
    add.set_shape(shape);
    add.set_state(state);
    add.set_role(role);
    for (const Vector3d& place : places) set_vec3(*add.add_places(), place);
    for (const std::string& sensor : sensors) add.add_sensors(sensor);
    submit(operation);
  }
  void submit(const v1::Operation& operation) {
    const auto submitted = model_.submit(operation);
    ASSERT_TRUE(submitted.ok()) << submitted.error().describe();
  }
  model::SculptPtr sheet() const { return model::as_sculpt(model_.document().find("sheet")); }
  model::SculptPtr seen() const { return model::as_sculpt(model_.preview().find("sheet")); }
  const model::SculptIcon& icon(const std::string& id) const { return *sheet()->find_icon(id); }
  bool has_icon(const std::string& id) const { return sheet()->find_icon(id) != nullptr; }
  /// Over the middle of its parameters.
  static double height(const model::SculptPtr& shape, double x, double y) {
    return shape->surface->evaluate(x + 0.2, y + 0.15).z() - sheet_z;
  }
  bool marked(const std::string& id, IconMark::Kind kind) const {
    const std::vector<IconMark> marks = interaction_.icon_marks();
    return std::any_of(marks.begin(), marks.end(), [&](const IconMark& mark) {
      return mark.name == IconName{"sheet", id} && mark.kind == kind;
    });
  }
  bool no_marks() const { return interaction_.icon_marks().empty(); }
  std::size_t steps() const { return model_.history().undo_steps(); }
};

}  // namespace handloft::interaction
