#pragma once
// Generators of random operations of every kind, and of sequences of them. A new operation is one more row of
// `own_makers`; what it must keep is one more line of broken_invariant() in document_invariants.h.

#include <rapidcheck.h>

#include <cmath>
#include <string>
#include <vector>

#include "any_operation.h"
#include "any_sculpting.h"
#include "document_invariants.h"
#include "proto/operation.pb.h"

namespace handloft::model::test {

namespace v1 = handloft::v1;

inline constexpr int bad_one_in = 300;  // Numbers that must be refused.

// --- numbers: full-sized from the first case on, mostly ordinary, sometimes what must be refused

inline std::string any_id() {
  return *rc::gen::element<std::string>("a", "b", "a-mirror", "b-mirror", "shape-1", "shape-2", "reference-1",
                                        "surface-1", "a-model.face-1");
}

inline std::string any_version() {
  return *rc::gen::element<std::string>("draft", "final");
}

inline std::string any_comment() {
  return *rc::gen::element<std::string>("comment-1", "comment-2", "comment-3");
}

inline std::uint32_t small_number(int below) {
  return static_cast<std::uint32_t>(in_range(0, below));
}

inline v1::Point any_point() {
  v1::Point point;
  *point.mutable_position() = any_vector(bad_one_in);
  point.set_pressure(0.1 * in_range(0, 11));
  return point;
}

inline v1::SetSymmetry any_symmetry(const std::string& id) {
  v1::SetSymmetry symmetry;
  symmetry.set_entity(id);
  symmetry.set_mode(static_cast<v1::SetSymmetry::Mode>(in_range(0, 3)));
  *symmetry.mutable_plane()->mutable_origin() = any_vector(bad_one_in);
  *symmetry.mutable_plane()->mutable_normal() = any_vector(bad_one_in);
  return symmetry;
}

inline v1::PointRegion any_region() {
  v1::PointRegion region;
  switch (in_range(0, 4)) {
    case 0:
      *region.mutable_sphere()->mutable_centre() = any_vector(bad_one_in);
      region.mutable_sphere()->set_radius_m(0.01 * in_range(0, 20));
      break;
    case 1: {
      const v1::Vec3 corner = any_vector(bad_one_in);
      *region.mutable_box()->mutable_minimum() = corner;
      region.mutable_box()->mutable_maximum()->set_x(corner.x() + 0.2);
      region.mutable_box()->mutable_maximum()->set_y(corner.y() + 0.2);
      region.mutable_box()->mutable_maximum()->set_z(corner.z() + 0.2);
      break;
    }
    case 2:
      region.mutable_strokes()->add_numbers(1 + small_number(4));
      break;
    default:
      for (int i = in_range(0, 4); i > 0; --i) region.mutable_indices()->add_indices(small_number(12));
      region.mutable_indices();
  }
  return region;
}

/// Round the footprint of shapes, or any knot.
inline std::vector<v1::Vec3> any_curve() {
  std::vector<v1::Vec3> curve;
  if (in_range(0, 3) == 0) {
    for (int i = in_range(0, 8); i > 0; --i) curve.push_back(any_vector(bad_one_in));
    return curve;
  }
  const double radius = 0.01 * in_range(1, 30);
  for (int i = 0; i < 24; ++i) {
    v1::Vec3 place;
    place.set_x(radius * std::cos(0.262 * i));
    place.set_y(radius * std::sin(0.262 * i));
    place.set_z(0.02 * std::cos(0.524 * i));
    curve.push_back(place);
  }
  return curve;
}

// --- one maker for every operation

struct Maker {
  const char* name;
  int weight;
  void (*fill)(const std::string& id, v1::Operation& operation);
};

inline const std::vector<Maker> own_makers{
    Maker{"create_dual_shape", 2,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_create_dual_shape()->set_id(*rc::gen::element(id, std::string("")));
            operation.mutable_create_dual_shape()->set_degree(small_number(8));
          }},
    Maker{"add_points", 8,
          [](const std::string& id, v1::Operation& operation) {
            auto& request = *operation.mutable_add_points();
            request.set_entity(id);
            request.set_stroke(small_number(4) % 3);
            request.set_min_spacing_m(0.01 * in_range(0, 3));
            request.set_refit(in_range(0, 3) == 0);
            if (in_range(0, 4) == 0) request.mutable_create();
            if (in_range(0, 8) == 0) *request.mutable_symmetry() = any_symmetry(id);
            for (int i = in_range(0, 16); i > 0; --i) *request.add_points() = any_point();
          }},
    Maker{"import_strokes", 2,
          [](const std::string& id, v1::Operation& operation) {
            // As the session hands it on: read from the file, without its path.
            auto& request = *operation.mutable_import_strokes();
            request.set_entity(id);
            for (int k = in_range(0, 4); k > 0; --k) {
              auto& stroke = *request.add_resolved();
              for (int i = in_range(1, 8); i > 0; --i) *stroke.add_points() = any_point();
            }
          }},
    Maker{"set_symmetry", 1,
          [](const std::string& id, v1::Operation& operation) {
            *operation.mutable_set_symmetry() = any_symmetry(id);
          }},
    Maker{"fit", 4,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_fit()->set_entity(id);
            operation.mutable_fit()->set_degree(small_number(7));
            operation.mutable_fit()->set_automatic_degree(in_range(0, 3) == 0);
          }},
    Maker{"refit_plane", 1,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_refit_plane()->set_entity(id);
          }},
    Maker{"set_superellipse", 1,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_set_superellipse()->set_entity(id);
            operation.mutable_set_superellipse()->set_exponent(0.1 * in_range(0, 220));
          }},
    Maker{"set_representation", 1,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_set_representation()->set_entity(id);
            operation.mutable_set_representation()->set_representation(
                static_cast<v1::Representation>(in_range(0, 4)));
          }},
    Maker{"rename", 1,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_rename()->set_entity(id);
            operation.mutable_rename()->set_name(*rc::gen::element<std::string>("x", "y", ""));
          }},
    Maker{
        "delete", 1,
        [](const std::string& id, v1::Operation& operation) { operation.mutable_delete_()->set_entity(id); }},
    Maker{"delete_points", 2,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_delete_points()->set_entity(id);
            *operation.mutable_delete_points()->mutable_region() = any_region();
          }},
    Maker{"move_points", 2,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_move_points()->set_entity(id);
            *operation.mutable_move_points()->mutable_region() = any_region();
            *operation.mutable_move_points()->mutable_by() = any_vector(bad_one_in);
          }},
    Maker{"transform", 2,
          [](const std::string& id, v1::Operation& operation) {
            auto& request = *operation.mutable_transform();
            request.add_entities(id);
            if (in_range(0, 4) == 0) request.add_entities(any_id());
            *request.mutable_translation() = any_vector(bad_one_in);
            if (in_range(0, 2) == 0) {
              request.mutable_rotation()->set_w(any_length(bad_one_in));
              request.mutable_rotation()->set_x(any_length(bad_one_in));
              request.mutable_rotation()->set_y(any_length(bad_one_in));
            }
            if (in_range(0, 2) == 0) request.set_scale(*rc::gen::element(0.5, 0.9, 1.25, 2.0, 0.0, -1.0));
            if (in_range(0, 2) == 0) *request.mutable_pivot() = any_vector(bad_one_in);
          }},
    Maker{"duplicate", 1,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_duplicate()->set_entity(id);
            operation.mutable_duplicate()->set_id(*rc::gen::element(any_id(), std::string("")));
            *operation.mutable_duplicate()->mutable_translation() = any_vector(bad_one_in);
          }},
    Maker{"set_boundary", 2,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_set_boundary()->set_entity(id);
            for (const v1::Vec3& place : any_curve()) *operation.mutable_set_boundary()->add_curve() = place;
          }},
    Maker{"push_points", 2,
          [](const std::string& id, v1::Operation& operation) {
            auto& request = *operation.mutable_push_points();
            request.add_entities(id);
            request.set_range(0.1 * in_range(0, 11));
            request.set_falloff(static_cast<v1::Falloff>(in_range(0, 2)));
            request.set_refit(in_range(0, 2) == 0);
            v1::Vec3 normal;
            normal.set_z(1);
            for (int i = 0; i < in_range(2, 5); ++i) {
              auto& pose = *request.add_path();
              *pose.mutable_centre() = any_vector(bad_one_in);
              *pose.mutable_normal() = in_range(0, 4) == 0 ? any_vector(bad_one_in) : normal;
              pose.set_radius_m(0.01 * in_range(1, 20));
              pose.set_time_ns(11'000'000LL * i);
            }
          }},
    Maker{"modify_profile", 6,
          [](const std::string& id, v1::Operation& operation) {
            auto& request = *operation.mutable_modify_profile();
            for (int k = in_range(1, 3); k > 0; --k) {
              auto& curve = *request.add_curves();
              for (int i = in_range(0, 12); i > 0; --i) *curve.add_points() = any_point();
              switch (in_range(0, 4)) {
                case 0:
                  curve.set_entity(id);
                  break;
                case 1:
                  curve.add_split_at(0.1 * in_range(0, 11));
                  curve.add_split_entities(id);
                  curve.add_split_entities(*rc::gen::element(any_id(), std::string("")));
                  break;
                default:
                  break;
              }
            }
            if (in_range(0, 3) == 0) {
              for (int k = in_range(1, 3); k > 0; --k) request.add_entities(any_id());
            }
            request.set_keep_as_points(in_range(0, 2) == 0);
          }},
    Maker{"import_reference", 1,
          [](const std::string& id, v1::Operation& operation) {
            auto& request = *operation.mutable_import_reference();
            request.set_id(*rc::gen::element(id, std::string("")));
            for (int i = 0; i < 12; ++i)
              request.mutable_resolved()->add_positions(0.01F * static_cast<float>(in_range(-20, 20)));
            for (int i = 0; i < 6; ++i) request.mutable_resolved()->add_indices(small_number(4));
          }},
    Maker{"new_alternative", 1,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_new_alternative()->set_name(*rc::gen::element(id, std::string("")));
            if (in_range(0, 3) == 0) operation.mutable_new_alternative()->set_version(any_version());
          }},
    Maker{"switch_alternative", 2,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_switch_alternative()->set_name(*rc::gen::element(id, std::string("main")));
          }},
    Maker{"restore_alternative", 1,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_restore_alternative()->set_name(*rc::gen::element(id, std::string("main")));
          }},
    Maker{"delete_alternative", 1,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_delete_alternative()->set_name(*rc::gen::element(id, std::string("main")));
          }},
    Maker{"name_version", 1,
          [](const std::string&, v1::Operation& operation) {
            operation.mutable_name_version()->set_name(any_version());
          }},
    Maker{"restore_version", 1,
          [](const std::string&, v1::Operation& operation) {
            operation.mutable_restore_version()->set_name(any_version());
          }},
    Maker{"delete_version", 1,
          [](const std::string&, v1::Operation& operation) {
            operation.mutable_delete_version()->set_name(any_version());
          }},
    Maker{"add_comment", 2,
          [](const std::string& id, v1::Operation& operation) {
            auto& request = *operation.mutable_add_comment();
            request.set_id(*rc::gen::element<std::string>("", "", "comment-2"));
            request.set_text("here");
            switch (in_range(0, 3)) {
              case 0:
                request.set_reply_to(any_comment());
                break;
              case 1:
                request.set_entity(id);
                break;
              default:
                *request.mutable_place() = any_vector(bad_one_in);
            }
          }},
    Maker{"change_comment", 2,
          [](const std::string&, v1::Operation& operation) {
            auto& request = *operation.mutable_change_comment();
            request.set_id(any_comment());
            if (in_range(0, 2) == 0) request.set_text(*rc::gen::element<std::string>("there", "here"));
            if (in_range(0, 2) == 0) request.set_resolved(in_range(0, 2) == 0);
          }},
    Maker{"delete_comment", 1,
          [](const std::string&, v1::Operation& operation) {
            operation.mutable_delete_comment()->set_id(any_comment());
          }},
    Maker{"undo", 2, [](const std::string&, v1::Operation& operation) { operation.mutable_undo(); }},
    Maker{"redo", 1, [](const std::string&, v1::Operation& operation) { operation.mutable_redo(); }},
};

/// With those of sculpting, each once: they have sequences of their own (sculpting_sequences_test.cpp).
inline const std::vector<Maker>& all_makers() {
  static const std::vector<Maker> makers = [] {
    std::vector<Maker> all = own_makers;
    for (const SculptingMaker& maker : sculpting_makers()) all.push_back({maker.name, 1, maker.fill});
    return all;
  }();
  return makers;
}

struct Made {
  const char* name;
  v1::Operation operation;
};

inline Made any_operation() {
  int total = 0;
  for (const Maker& maker : all_makers()) total += maker.weight;
  int pick = in_range(0, total);
  for (const Maker& maker : all_makers()) {
    pick -= maker.weight;
    if (pick >= 0) continue;
    Made made{maker.name, {}};
    maker.fill(any_id(), made.operation);
    return made;
  }
  return {};
}

/// Something to work on, or most operations would only learn that there is no such entity: two shapes of 20
/// points each, mirrored as chance has it.
inline std::vector<Made> any_sequence() {
  std::vector<Made> sequence;
  for (const char* id : {"a", "b"}) {
    Made made{"add_points", {}};
    auto& request = *made.operation.mutable_add_points();
    request.set_entity(id);
    request.mutable_create()->set_degree(1 + small_number(3));
    request.mutable_symmetry()->set_mode(static_cast<v1::SetSymmetry::Mode>(in_range(0, 3)));
    request.mutable_symmetry()->mutable_plane()->mutable_normal()->set_x(1);
    for (int i = 0; i < 20; ++i) *request.add_points() = any_point();
    sequence.push_back(made);
  }
  for (int i = in_range(1, longest_sequence - 1); i > 0; --i) sequence.push_back(any_operation());
  return sequence;
}

}  // namespace handloft::model::test
