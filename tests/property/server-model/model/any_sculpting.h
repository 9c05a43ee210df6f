#pragma once
// Random operations on sculpted surfaces (D1 - D21): of small surfaces, mostly such as apply.

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "any_operation.h"
#include "proto/operation.pb.h"

namespace handloft::model::test {

struct SculptingMaker {
  const char* name;
  int weight;
  void (*fill)(const std::string& id, handloft::v1::Operation& operation);
};

inline constexpr int bad_sculpting_one_in = 300;  ///< Numbers that must be refused.

inline std::string any_icon_id() {
  return *rc::gen::element<std::string>("p", "q", "r", "icon-1", "icon-2");
}

/// Within the sheets, 0.1 .. 0.5 m wide, or beyond one, which in closed directions is across the seam.
inline handloft::v1::Vec2 any_parameters() {
  handloft::v1::Vec2 at;
  at.set_x(0.01 * in_range(-1, 30));
  at.set_y(0.01 * (in_range(0, 4) > 0 ? in_range(-1, 30) : in_range(-100, 150)));
  if (in_range(0, bad_sculpting_one_in) == 0) at.set_x(any_length(1));
  return at;
}

/// Centimetres: half of a drag's.
inline handloft::v1::Vec3 any_drag() {
  handloft::v1::Vec3 drag = any_vector(bad_sculpting_one_in);
  drag.set_x(0.1 * drag.x());
  drag.set_y(0.1 * drag.y());
  drag.set_z(0.2 * drag.z());
  return drag;
}

/// Control points over a unit-spaced net with bumps; one direction closed as chance has it.
inline void any_bspline(handloft::v1::BSplineSurface& surface) {
  const int p = in_range(1, 4), q = in_range(2, 4), nu = p + in_range(1, 5), nv = q + in_range(2, 5);
  const bool closed = in_range(0, 3) == 0;
  surface.set_degree_u(static_cast<std::uint32_t>(p));
  surface.set_degree_v(static_cast<std::uint32_t>(q));
  for (int i = 0; i < nu + p + 1; ++i) surface.add_knots_u(std::clamp(i - p, 0, nu - p));
  if (closed) {
    surface.set_periodic_v(true);
    for (int j = 0; j < nv + 2 * q + 1; ++j) surface.add_knots_v(j - q);
  } else {
    for (int j = 0; j < nv + q + 1; ++j) surface.add_knots_v(std::clamp(j - q, 0, nv - q));
  }
  const double turn = 2 * 3.14159265358979 / nv;
  for (int i = 0; i < nu; ++i) {
    for (int j = 0; j < nv; ++j) {
      const double bump = 1e-3 * in_range(-10, 10);
      if (closed) {
        surface.add_control(0.05 * i);
        surface.add_control((0.1 + bump) * std::cos(turn * j));
        surface.add_control((0.1 + bump) * std::sin(turn * j));
      } else {
        surface.add_control(0.05 * i);
        surface.add_control(0.05 * j);
        surface.add_control(bump);
      }
      if (i + j == 0 && in_range(0, bad_sculpting_one_in) == 0) surface.set_control(0, any_length(1));
    }
  }
  if (in_range(0, 3) != 0) return;
  for (int i = 0; i < nu * nv; ++i) surface.add_weights(0.1 * in_range(5, 20));
}

inline void any_sheet(const std::string& id, handloft::v1::CreateSculptSurface& request) {
  request.set_id(*rc::gen::element(id, std::string("")));
  request.set_control_u(static_cast<std::uint32_t>(in_range(0, 9)));
  request.set_control_v(static_cast<std::uint32_t>(in_range(0, 9)));
  request.set_tolerance_m(0.001 * in_range(0, 4));
  switch (in_range(0, 10)) {
    case 0:
      request.set_fitted(*rc::gen::element<std::string>("a", "b"));
      break;
    case 1:
      request.set_points(*rc::gen::element<std::string>("a", "b"));
      break;
    case 2:
      request.set_mesh(*rc::gen::element<std::string>("reference-1", "a"));
      break;
    case 3:
    case 4:
    case 5:
      any_bspline(*request.mutable_surface());
      break;
    default: {
      auto& rectangle = *request.mutable_rectangle();
      rectangle.set_width_m(0.1 * in_range(1, 6));
      rectangle.set_depth_m(0.1 * in_range(1, 6));
      rectangle.set_degree(static_cast<std::uint32_t>(in_range(0, 5)));
      if (in_range(0, 3) > 0) break;
      *rectangle.mutable_pose()->mutable_position() = any_vector(bad_sculpting_one_in);
      rectangle.mutable_pose()->mutable_orientation()->set_w(1);
      rectangle.mutable_pose()->mutable_orientation()->set_x(any_length(bad_sculpting_one_in));
    }
  }
}

inline handloft::v1::IconProperty any_property() {
  using handloft::v1::IconProperty;
  return static_cast<IconProperty>(in_range(0, 3) > 0 ? in_range(0, 2) : in_range(0, 9));
}

inline void any_icon(const std::string& id, handloft::v1::AddIcon& request) {
  request.set_entity(id);
  request.set_id(*rc::gen::element(any_icon_id(), std::string("")));
  const int shape = std::max(0, in_range(-2, 4)) % 3;
  request.set_shape(static_cast<handloft::v1::IconShape>(shape));
  const int count = shape == 0 ? 1 : shape == 2 ? 2 : in_range(2, 5);
  for (int i = 0; i < count; ++i) {
    if (shape != 0 || in_range(0, 4) > 0) {
      *request.add_parameters() = any_parameters();
    } else {
      *request.add_places() = any_vector(bad_sculpting_one_in);
    }
  }
  if (shape == 2 && request.parameters_size() == 2 && in_range(0, 4) == 0)  // Narrower than a span may be.
    request.mutable_parameters(1)->set_x(request.parameters(0).x() + 1e-4 * in_range(0, 3));
  request.set_role(static_cast<handloft::v1::IconRole>(in_range(0, 3)));
  if (shape == 0) request.set_property(any_property());
  if (in_range(0, 4) == 0) request.set_state(static_cast<handloft::v1::IconState>(in_range(1, 5)));
  if (in_range(0, 4) == 0) request.set_stiffness(10.0 * in_range(-1, 50));
  if (in_range(0, 4) == 0) request.add_sensors("hand");
  request.set_outside(shape == 2 && in_range(0, 4) == 0);
  if (in_range(0, 12) == 0) any_sheet(id, *request.mutable_create());
}

inline void any_model(const std::string& id, handloft::v1::ImportModel& request) {
  // As the session hands it on: read from the file, without its path.
  request.set_id(*rc::gen::element(id + "-model", std::string("")));
  auto& resolved = *request.mutable_resolved();
  resolved.set_boundary_representation("bytes that only the exchange reads");
  resolved.set_metres_per_unit(in_range(0, 20) == 0 ? 0 : 0.001);
  for (int i = in_range(0, 3); i > 0; --i) {
    auto& face = *resolved.add_faces();
    face.set_number(static_cast<std::uint32_t>(in_range(1, 6)));
    any_bspline(*face.mutable_surface());
    face.set_reversed(in_range(0, 2) == 0);
    if (in_range(0, 2) == 0) continue;
    auto& curve = *face.add_loops()->add_curves();
    curve.set_degree(1);
    for (const double knot : {0, 0, 1, 2, 3, 4, 4}) curve.add_knots(knot);
    for (const double c : {0.1, 0.1, 0.9, 0.1, 0.9, 0.9, 0.1, 0.9, 0.1, 0.1}) curve.add_control(c);
  }
}

inline const std::vector<SculptingMaker>& sculpting_makers() {
  using handloft::v1::Operation;
  static const std::vector<SculptingMaker> makers{
      {"create_sculpt_surface", 2,
       [](const std::string& id, Operation& operation) {
         any_sheet(id, *operation.mutable_create_sculpt_surface());
       }},
      {"set_sculpting", 3,
       [](const std::string& id, Operation& operation) {
         auto& request = *operation.mutable_set_sculpting();
         request.set_entity(id);
         if (in_range(0, 3) == 0) {
           auto& energy = *request.mutable_energy();
           energy.set_a11(0.1 * in_range(0, 10));
           energy.set_a12(0.1 * in_range(-1, 2));
           energy.set_a22(0.1 * in_range(0, 10));
           energy.set_b11(in_range(0, 3));
           energy.set_b12(in_range(0, 3));
           energy.set_b22(in_range(0, 3));
         }
         const auto side = [] {
           return static_cast<handloft::v1::EdgeSupport>(in_range(0, 2) == 0 ? 3 : in_range(0, 5));
         };
         if (in_range(0, 2) == 0) {
           request.set_u_lower(side());
           request.set_u_upper(side());
           request.set_v_lower(side());
           request.set_v_upper(side());
         }
         request.set_mode(
             static_cast<handloft::v1::SetSculpting::Mode>(in_range(0, 4) == 0 ? 2 : in_range(0, 2)));
         request.set_least_squares(in_range(0, 3) == 0);
       }},
      {"add_icon", 8,
       [](const std::string& id, Operation& operation) { any_icon(id, *operation.mutable_add_icon()); }},
      {"change_icon", 5,
       [](const std::string& id, Operation& operation) {
         auto& request = *operation.mutable_change_icon();
         request.set_entity(id);
         request.set_icon(any_icon_id());
         if (in_range(0, 3) == 0) request.set_role(static_cast<handloft::v1::IconRole>(in_range(1, 3)));
         if (in_range(0, 3) == 0) request.set_property(any_property());
         if (in_range(0, 2) == 0) request.set_state(static_cast<handloft::v1::IconState>(in_range(1, 4)));
         if (in_range(0, 4) == 0) request.set_stiffness(10.0 * in_range(-1, 50));
         if (in_range(0, 4) == 0) request.add_sensors("spacemouse");
       }},
      {"drag_icon", 12,
       [](const std::string& id, Operation& operation) {
         auto& request = *operation.mutable_drag_icon();
         request.set_entity(id);
         request.set_icon(any_icon_id());
         *request.mutable_translation() = any_drag();
         switch (in_range(0, 4)) {
           case 0:
             request.mutable_rotation()->set_w(1);
             request.mutable_rotation()->set_x(any_length(bad_sculpting_one_in));
             request.mutable_rotation()->set_y(any_length(bad_sculpting_one_in));
             break;
           case 1:
             request.set_held_at(0.1 * in_range(0, 11));
             request.set_reach_m(0.05 * in_range(0, 5));
             break;
           default:
             break;
         }
       }},
      {"delete_icon", 2,
       [](const std::string& id, Operation& operation) {
         operation.mutable_delete_icon()->set_entity(id);
         operation.mutable_delete_icon()->set_icon(any_icon_id());
       }},
      {"commit_sculpting", 2,
       [](const std::string& id, Operation& operation) {
         operation.mutable_commit_sculpting()->set_entity(id);
       }},
      {"recover_sculpting", 1,
       [](const std::string& id, Operation& operation) {
         operation.mutable_recover_sculpting()->set_entity(id);
       }},
      {"refine_surface", 2,
       [](const std::string& id, Operation& operation) {
         operation.mutable_refine_surface()->set_entity(id);
         operation.mutable_refine_surface()->set_control_u(static_cast<std::uint32_t>(in_range(0, 11)));
         operation.mutable_refine_surface()->set_control_v(static_cast<std::uint32_t>(in_range(0, 11)));
       }},
      {"import_model", 1,
       [](const std::string& id, Operation& operation) { any_model(id, *operation.mutable_import_model()); }},
  };
  return makers;
}

}  // namespace handloft::model::test
