// Every operation, one by one: undo restores every bit (A28), a gesture that is
// cancelled leaves no trace (X4), the log replays to the same bits (X2), and a linked partner stays the
// mirror image (X6, A12).

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "profile_helpers.h"
#include "sculpt_helpers.h"
#include "server-model/geometry/symmetry.h"

namespace handloft::model::test {
namespace {

using geometry::Vec3;

/// These two are what brings states back, and an export changes none.
const std::set<std::string> not_undone = {"undo", "redo", "export"};

void write(const Vec3& from, v1::Vec3& to) {
  to.set_x(from.x());
  to.set_y(from.y());
  to.set_z(from.z());
}

/// Three points of "a" and those near it.
v1::PointRegion some_points() {
  v1::PointRegion region;
  for (const std::uint32_t i : {3U, 17U, 30U}) region.mutable_indices()->add_indices(i);
  return region;
}

v1::Operation plate(const std::string& id) {
  v1::Operation operation;
  auto& request = *operation.mutable_import_reference();
  request.set_id(id);
  for (const float value : {-1.0F, -1.0F, 0.0F, 1.0F, -1.0F, 0.0F, 0.0F, 1.0F, 0.0F}) {
    request.mutable_resolved()->add_positions(value);
  }
  for (const std::uint32_t index : {0U, 1U, 2U}) request.mutable_resolved()->add_indices(index);
  return operation;
}

/// A sheet of 8 x 7 control points, committed with a bump that is dragged by one icon; another one sleeps.
std::vector<v1::Operation> sculpted_sheet() {
  return {
      operation(R"({"create_sculpt_surface": {"id": "sheet", "rectangle": {"width_m": 0.4, "depth_m": 0.3},
                  "control_u": 8, "control_v": 7}})"),
      operation(R"({"add_icon": {"entity": "sheet", "id": "p", "parameters": [{"x": 0.2, "y": 0.15}]}})"),
      operation(R"({"drag_icon": {"entity": "sheet", "icon": "p", "translation": {"z": 0.02}}})"),
      operation(R"({"commit_sculpting": {"entity": "sheet"}})"),
      operation(R"({"drag_icon": {"entity": "sheet", "icon": "p", "translation": {"x": 0.01}}})"),
      operation(R"({"add_icon": {"entity": "sheet", "id": "q", "parameters": [{"x": 0.1, "y": 0.1}],
                  "state": "ICON_SLEEPING"}})")};
}

/// "a" with its linked partner, fitted over the base plane of its first points; "b" for itself; a reference;
/// two alternatives; a sculpted sheet; a version and a comment.
Document scene() {
  v1::Operation other;
  other.mutable_new_alternative()->set_name("other");
  v1::Operation back;
  back.mutable_switch_alternative()->set_name("main");
  const Document shapes = applied(
      {}, {create("a"), symmetry("a", v1::SetSymmetry::PARTNER, -0.01), add("a", random_points(60, 71, 0.05)),
           fit("a"), add("a", random_points(20, 73, 0.06)), fit("a"), create("b"),
           add("b", random_points(50, 72)), fit("b", 3), plate("floor"), other, rename("b", "B"), back});
  const Document sculpted = applied(shapes, sculpted_sheet());
  return applied(sculpted, {operation(R"({"name_version": {"name": "draft"}})"), rename("b", "Back"),
                            operation(R"({"add_comment": {"text": "Here", "entity": "a"}})")});
}

/// By the name of its field in the message. Those of shapes are for "a", so that its partner is to follow.
std::map<std::string, v1::Operation> every_operation() {
  std::map<std::string, v1::Operation> all;
  all["create_dual_shape"] = create("c", 4);
  all["add_points"] = add("a", {point(0.05, 0.01, 0.03, 0.5), point(0.051, 0.012, 0.02, 0.25)});
  all["set_symmetry"] = symmetry("a", v1::SetSymmetry::OFF);
  all["fit"] = fit("a", 3);
  all["set_superellipse"] = superellipse("a", 3.5);
  all["set_representation"] = represent("a", v1::REPRESENTATION_SURFACE);
  all["rename"] = rename("a", "Wing");
  all["delete"] = remove("a");
  all["refit_plane"] = refit_plane("a");
  auto& strokes = *all["import_strokes"].mutable_import_strokes();
  strokes.set_entity("a");
  for (int k = 0; k < 2; ++k) {
    auto& stroke = *strokes.add_resolved();
    for (int i = 0; i < 5; ++i) *stroke.add_points() = point(0.04 + 0.002 * i, 0.005 * k, 0.01, 0.2 * i);
  }
  auto& push = *all["push_points"].mutable_push_points();
  push.add_entities("a");
  push.set_range(0.4);
  push.set_refit(true);
  for (const double z : {0.03, -0.02}) {
    auto& pose = *push.add_path();
    write({0.05, 0, z}, *pose.mutable_centre());
    write({0.1, 0, -1}, *pose.mutable_normal());
    pose.set_radius_m(0.01);
  }
  all["modify_profile"] = profile({curve(arch(0.02, 0.005, 0.05), "a")}, true);
  auto& boundary = *all["set_boundary"].mutable_set_boundary();
  boundary.set_entity("a");
  for (int i = 0; i <= 40; ++i) {
    const double angle = 0.05 * 3.14159265358979 * i;
    write({0.05 + 0.02 * std::cos(angle), 0.015 * std::sin(angle), 0.01}, *boundary.add_curve());
  }
  all["delete_points"].mutable_delete_points()->set_entity("a");
  *all["delete_points"].mutable_delete_points()->mutable_region() = some_points();
  all["move_points"].mutable_move_points()->set_entity("a");
  *all["move_points"].mutable_move_points()->mutable_region() = some_points();
  write({0.001, 0.002, 0.003}, *all["move_points"].mutable_move_points()->mutable_by());
  auto& transform = *all["transform"].mutable_transform();
  transform.add_entities("a");
  write({0.01, -0.02, 0.03}, *transform.mutable_translation());
  transform.mutable_rotation()->set_w(0.9);
  transform.mutable_rotation()->set_x(0.2);
  transform.mutable_rotation()->set_z(0.3);
  transform.set_scale(1.25);
  all["duplicate"].mutable_duplicate()->set_entity("a");
  write({0, 0.1, 0}, *all["duplicate"].mutable_duplicate()->mutable_translation());
  all["import_reference"] = plate("wall");
  all["new_alternative"].mutable_new_alternative()->set_name("third");
  all["switch_alternative"].mutable_switch_alternative()->set_name("other");
  all["restore_alternative"].mutable_restore_alternative()->set_name("other");
  all["delete_alternative"].mutable_delete_alternative()->set_name("other");
  all["create_sculpt_surface"] =
      operation(R"({"create_sculpt_surface": {"id": "hood", "fitted": "a", "control_u": 9}})");
  all["set_sculpting"] = operation(R"({"set_sculpting": {"entity": "sheet", "u_lower": "EDGE_SUPPORTED",
                  "energy": {"a11": 0.1, "a22": 0.1, "b11": 1, "b12": 1, "b22": 2}}})");
  all["add_icon"] = operation(R"({"add_icon": {"entity": "sheet", "shape": "ICON_CURVE",
                                "places": [{"x": 0.1, "y": -0.05}, {"x": 0.1, "y": 0.05}]}})");
  all["change_icon"] = operation(R"({"change_icon": {"entity": "sheet", "icon": "q", "state": "ICON_DRIVING",
                  "role": "ICON_LOAD", "stiffness": 3, "sensors": ["hand"]}})");
  all["drag_icon"] = operation(R"({"drag_icon": {"entity": "sheet", "icon": "p", "translation": {"z": 0.01},
                                 "rotation": {"w": 0.9, "x": 0.2}}})");
  all["delete_icon"] = operation(R"({"delete_icon": {"entity": "sheet", "icon": "p"}})");
  all["commit_sculpting"] = operation(R"({"commit_sculpting": {"entity": "sheet"}})");
  all["recover_sculpting"] = operation(R"({"recover_sculpting": {"entity": "sheet"}})");
  all["refine_surface"] = operation(R"({"refine_surface": {"entity": "sheet", "control_u": 11}})");
  all["import_model"] = operation(R"({"import_model": {"id": "car", "resolved": {
      "boundary_representation": "b25seSB0aGUgZXhjaGFuZ2UgcmVhZHMgdGhpcw==", "metres_per_unit": 0.001,
      "faces": [{"number": 3, "surface": {"degree_u": 1, "degree_v": 1, "knots_u": [0, 0, 1, 1],
                 "knots_v": [0, 0, 1, 1], "control": [0, 0, 0, 0, 0.2, 0, 0.3, 0, 0, 0.3, 0.2, 0.1]}}]}}})");
  all["name_version"] = operation(R"({"name_version": {"name": "final"}})");
  all["restore_version"] = operation(R"({"restore_version": {"name": "draft"}})");
  all["delete_version"] = operation(R"({"delete_version": {"name": "draft"}})");
  all["add_comment"] = operation(R"({"add_comment": {"text": "There", "place": {"x": 0.1}}})");
  all["change_comment"] = operation(R"({"change_comment": {"id": "comment-1", "resolved": true}})");
  all["delete_comment"] = operation(R"({"delete_comment": {"id": "comment-1"}})");
  return all;
}

TEST(EveryOperation, A28_HasItsTestHere) {
  const auto all = every_operation();
  const auto* body = v1::Operation::descriptor()->FindOneofByName("body");
  ASSERT_NE(body, nullptr);
  std::size_t expected = 0;
  for (int i = 0; i < body->field_count(); ++i) {
    const auto* field = body->field(i);
    if (not_undone.contains(field->name())) continue;
    ++expected;
    const auto found = all.find(field->name());
    ASSERT_NE(found, all.end()) << field->name() << " is an operation without a line in every_operation()";
    EXPECT_EQ(found->second.body_case(), field->number()) << field->name();
  }
  EXPECT_EQ(all.size(), expected);
}

TEST(EveryOperation, A28_UndoIsBitIdenticalAndX2RedoAndReplayAre) {
  const Document start = scene();
  const std::string before = document_hash(start);
  for (const auto& [name, operation] : every_operation()) {
    Model model(start);
    const auto submitted = model.submit(operation);
    ASSERT_TRUE(submitted.ok()) << name << ": " << submitted.error().describe();
    const std::string after = document_hash(model.document());
    EXPECT_NE(after, before) << name << " must do something here";
    EXPECT_EQ(document_hash(start), before) << name << " changed what it was given";
    for (int round = 0; round < 2; ++round) {
      ASSERT_TRUE(model.submit(undo()).ok());
      EXPECT_EQ(document_hash(model.document()), before) << name;
      ASSERT_TRUE(model.submit(redo()).ok());
      EXPECT_EQ(document_hash(model.document()), after) << name;
    }
    Model replayed(start);
    ASSERT_TRUE(replayed.submit(submitted->effective).ok()) << name;
    EXPECT_EQ(document_hash(replayed.document()), after) << name;
  }
}

TEST(EveryOperation, X4_CancelledInTheAirLeavesNoTrace) {
  const Document start = scene();
  const std::string before = document_hash(start);
  int shown = 0;
  for (const auto& [name, operation] : every_operation()) {
    Model model(start);
    const auto gesture = model.begin_provisional(operation);
    ASSERT_TRUE(gesture.ok()) << name << ": " << gesture.error().describe();
    shown += document_hash(model.preview()) != before ? 1 : 0;
    EXPECT_EQ(document_hash(model.document()), before) << name;
    EXPECT_TRUE(model.cancel_provisional(*gesture));
    EXPECT_EQ(document_hash(model.preview()), before) << name;
    EXPECT_EQ(model.history().undo_steps(), 0U) << name;
    EXPECT_EQ(model.sequence(), 0U) << name;
  }
  EXPECT_GE(shown, 29) << "all but those that change the list of alternatives alone";
}

TEST(EveryOperation, X6_ALinkedPartnerStaysTheMirrorImage) {
  const Document start = scene();
  int linked = 0;
  for (const auto& [name, operation] : every_operation()) {
    const Document after = must(start, operation).document;
    const DualPtr a = after.find_dual("a");
    if (!a || a->partner.empty()) continue;  // Deleted or released.
    ++linked;
    const DualPtr b = after.find_dual(a->partner);
    ASSERT_TRUE(b) << name;
    EXPECT_EQ(b->representation, a->representation) << name;
    EXPECT_EQ(b->superellipse_exponent, a->superellipse_exponent) << name;
    EXPECT_EQ(b->stale, a->stale) << name;
    ASSERT_EQ(b->points.size(), a->points.size()) << name;
    for (std::size_t i = 0; i < a->points.size(); ++i) {
      const Vec3 image = geometry::reflect_point(a->points[i].position(), a->plane);
      EXPECT_LE((b->points[a->mirror_partner(i)].position() - image).norm(), 1e-12) << name;
    }
    ASSERT_TRUE(a->fitted() && b->fitted()) << name;
    ASSERT_EQ(b->fit->surface.degree(), a->fit->surface.degree()) << name;
    const auto trim_a = a->trim();
    const auto trim_b = b->trim();
    ASSERT_TRUE(trim_a.ok() && trim_b.ok()) << name;
    for (int i = -4; i <= 4; ++i) {
      for (int j = -3; j <= 3; ++j) {
        const double x = 0.01 * i;
        const double y = 0.01 * j;
        const Vec3 on_a = a->fit->surface.world_point(a->fit->frame, x, y);
        const Vec3 image = b->fit->frame.to_local(geometry::reflect_point(on_a, a->plane));
        EXPECT_NEAR(b->fit->surface.value(image.x(), image.y()), image.z(), 1e-12) << name;
        EXPECT_NEAR(trim_b->opacity(image.head<2>()), trim_a->opacity({x, y}), 1e-9) << name;
      }
    }
  }
  EXPECT_GT(linked, 25);
}

}  // namespace
}  // namespace handloft::model::test
