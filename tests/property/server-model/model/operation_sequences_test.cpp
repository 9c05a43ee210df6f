// Random sequences of all operations: none leaves NaN or breaks an invariant of the document (X5, A12), and
// undoing them one by one gives back every document to the bit, by its canonical hash (A28).
// A new operation is one more row of `own_makers`; what it must keep is one more line of
// broken_invariant() in document_invariants.h.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "any_operation.h"
#include "any_sculpting.h"
#include "document_invariants.h"
#include "server-model/model/canonical.h"
#include "server-model/model/model.h"
#include "state_round_trip.h"
#include "tests/support/build_kind.h"

namespace handloft::model {
namespace {

namespace v1 = handloft::v1;

constexpr int bad_one_in = 300;  // Numbers that must be refused.

/// 1,000 sequences of up to 60 operations, which are some 0.7 s here; a sanitized build is ten
/// times as slow, and does a tenth.
constexpr int cases = 100;
constexpr int sequences_per_case = handloft::test::sanitized ? 1 : 10;
using test::longest_sequence;

// --- numbers: full-sized from the first case on, mostly ordinary, sometimes what must be refused

std::string any_id() {
  return *rc::gen::element<std::string>("a", "b", "a-mirror", "b-mirror", "shape-1", "shape-2", "reference-1",
                                        "surface-1", "a-model.face-1");
}

std::uint32_t small_number(int below) {
  return static_cast<std::uint32_t>(test::in_range(0, below));
}

v1::Point any_point() {
  v1::Point point;
  *point.mutable_position() = test::any_vector(bad_one_in);
  point.set_pressure(0.1 * test::in_range(0, 11));
  return point;
}

v1::SetSymmetry any_symmetry(const std::string& id) {
  v1::SetSymmetry symmetry;
  symmetry.set_entity(id);
  symmetry.set_mode(static_cast<v1::SetSymmetry::Mode>(test::in_range(0, 3)));
  *symmetry.mutable_plane()->mutable_origin() = test::any_vector(bad_one_in);
  *symmetry.mutable_plane()->mutable_normal() = test::any_vector(bad_one_in);
  return symmetry;
}

v1::PointRegion any_region() {
  v1::PointRegion region;
  switch (test::in_range(0, 4)) {
    case 0:
      *region.mutable_sphere()->mutable_centre() = test::any_vector(bad_one_in);
      region.mutable_sphere()->set_radius_m(0.01 * test::in_range(0, 20));
      break;
    case 1: {
      const v1::Vec3 corner = test::any_vector(bad_one_in);
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
      for (int i = test::in_range(0, 4); i > 0; --i) region.mutable_indices()->add_indices(small_number(12));
      region.mutable_indices();
  }
  return region;
}

/// Round the footprint of shapes, or any knot.
std::vector<v1::Vec3> any_curve() {
  std::vector<v1::Vec3> curve;
  if (test::in_range(0, 3) == 0) {
    for (int i = test::in_range(0, 8); i > 0; --i) curve.push_back(test::any_vector(bad_one_in));
    return curve;
  }
  const double radius = 0.01 * test::in_range(1, 30);
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

const std::vector<Maker> own_makers{
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
            request.set_min_spacing_m(0.01 * test::in_range(0, 3));
            request.set_refit(test::in_range(0, 3) == 0);
            if (test::in_range(0, 4) == 0) request.mutable_create();
            if (test::in_range(0, 8) == 0) *request.mutable_symmetry() = any_symmetry(id);
            for (int i = test::in_range(0, 16); i > 0; --i) *request.add_points() = any_point();
          }},
    Maker{"import_strokes", 2,
          [](const std::string& id, v1::Operation& operation) {
            // As the session hands it on: read from the file, without its path.
            auto& request = *operation.mutable_import_strokes();
            request.set_entity(id);
            for (int k = test::in_range(0, 4); k > 0; --k) {
              auto& stroke = *request.add_resolved();
              for (int i = test::in_range(1, 8); i > 0; --i) *stroke.add_points() = any_point();
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
            operation.mutable_fit()->set_automatic_degree(test::in_range(0, 3) == 0);
          }},
    Maker{"refit_plane", 1,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_refit_plane()->set_entity(id);
          }},
    Maker{"set_superellipse", 1,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_set_superellipse()->set_entity(id);
            operation.mutable_set_superellipse()->set_exponent(0.1 * test::in_range(0, 220));
          }},
    Maker{"set_representation", 1,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_set_representation()->set_entity(id);
            operation.mutable_set_representation()->set_representation(
                static_cast<v1::Representation>(test::in_range(0, 4)));
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
            *operation.mutable_move_points()->mutable_by() = test::any_vector(bad_one_in);
          }},
    Maker{"transform", 2,
          [](const std::string& id, v1::Operation& operation) {
            auto& request = *operation.mutable_transform();
            request.add_entities(id);
            if (test::in_range(0, 4) == 0) request.add_entities(any_id());
            *request.mutable_translation() = test::any_vector(bad_one_in);
            if (test::in_range(0, 2) == 0) {
              request.mutable_rotation()->set_w(test::any_length(bad_one_in));
              request.mutable_rotation()->set_x(test::any_length(bad_one_in));
              request.mutable_rotation()->set_y(test::any_length(bad_one_in));
            }
            if (test::in_range(0, 2) == 0)
              request.set_scale(*rc::gen::element(0.5, 0.9, 1.25, 2.0, 0.0, -1.0));
            if (test::in_range(0, 2) == 0) *request.mutable_pivot() = test::any_vector(bad_one_in);
          }},
    Maker{"duplicate", 1,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_duplicate()->set_entity(id);
            operation.mutable_duplicate()->set_id(*rc::gen::element(any_id(), std::string("")));
            *operation.mutable_duplicate()->mutable_translation() = test::any_vector(bad_one_in);
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
            request.set_range(0.1 * test::in_range(0, 11));
            request.set_falloff(static_cast<v1::Falloff>(test::in_range(0, 2)));
            request.set_refit(test::in_range(0, 2) == 0);
            v1::Vec3 normal;
            normal.set_z(1);
            for (int i = 0; i < test::in_range(2, 5); ++i) {
              auto& pose = *request.add_path();
              *pose.mutable_centre() = test::any_vector(bad_one_in);
              *pose.mutable_normal() = test::in_range(0, 4) == 0 ? test::any_vector(bad_one_in) : normal;
              pose.set_radius_m(0.01 * test::in_range(1, 20));
              pose.set_time_ns(11'000'000LL * i);
            }
          }},
    Maker{"modify_profile", 6,
          [](const std::string& id, v1::Operation& operation) {
            auto& request = *operation.mutable_modify_profile();
            for (int k = test::in_range(1, 3); k > 0; --k) {
              auto& curve = *request.add_curves();
              for (int i = test::in_range(0, 12); i > 0; --i) *curve.add_points() = any_point();
              switch (test::in_range(0, 4)) {
                case 0:
                  curve.set_entity(id);
                  break;
                case 1:
                  curve.add_split_at(0.1 * test::in_range(0, 11));
                  curve.add_split_entities(id);
                  curve.add_split_entities(*rc::gen::element(any_id(), std::string("")));
                  break;
                default:
                  break;
              }
            }
            if (test::in_range(0, 3) == 0) {
              for (int k = test::in_range(1, 3); k > 0; --k) request.add_entities(any_id());
            }
            request.set_keep_as_points(test::in_range(0, 2) == 0);
          }},
    Maker{"import_reference", 1,
          [](const std::string& id, v1::Operation& operation) {
            auto& request = *operation.mutable_import_reference();
            request.set_id(*rc::gen::element(id, std::string("")));
            for (int i = 0; i < 12; ++i)
              request.mutable_resolved()->add_positions(0.01F * static_cast<float>(test::in_range(-20, 20)));
            for (int i = 0; i < 6; ++i) request.mutable_resolved()->add_indices(small_number(4));
          }},
    Maker{"new_alternative", 1,
          [](const std::string& id, v1::Operation& operation) {
            operation.mutable_new_alternative()->set_name(*rc::gen::element(id, std::string("")));
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
    Maker{"undo", 2, [](const std::string&, v1::Operation& operation) { operation.mutable_undo(); }},
    Maker{"redo", 1, [](const std::string&, v1::Operation& operation) { operation.mutable_redo(); }},
};

/// With those of sculpting, each once: they have sequences of their own (sculpting_sequences_test.cpp).
const std::vector<Maker>& all_makers() {
  static const std::vector<Maker> makers = [] {
    std::vector<Maker> all = own_makers;
    for (const test::SculptingMaker& maker : test::sculpting_makers())
      all.push_back({maker.name, 1, maker.fill});
    return all;
  }();
  return makers;
}

struct Made {
  const char* name;
  v1::Operation operation;
};

Made any_operation() {
  int total = 0;
  for (const Maker& maker : all_makers()) total += maker.weight;
  int pick = test::in_range(0, total);
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
std::vector<Made> any_sequence() {
  std::vector<Made> sequence;
  for (const char* id : {"a", "b"}) {
    Made made{"add_points", {}};
    auto& request = *made.operation.mutable_add_points();
    request.set_entity(id);
    request.mutable_create()->set_degree(1 + small_number(3));
    request.mutable_symmetry()->set_mode(static_cast<v1::SetSymmetry::Mode>(test::in_range(0, 3)));
    request.mutable_symmetry()->mutable_plane()->mutable_normal()->set_x(1);
    for (int i = 0; i < 20; ++i) *request.add_points() = any_point();
    sequence.push_back(made);
  }
  for (int i = test::in_range(1, longest_sequence - 1); i > 0; --i) sequence.push_back(any_operation());
  return sequence;
}

TEST(OperationSequences, A28X5KeepEveryInvariantAndUndoToTheBit) {
  std::map<std::string, int> applied;
  int sequences = 0;
  std::size_t longest = 0;
  EXPECT_TRUE(rc::check([&] {
    for (int round = 0; round < sequences_per_case; ++round) {
      Model model;
      v1::Operation undo;
      undo.mutable_undo();
      // The hashes on the way from the empty document to the present one.
      std::vector<std::string> path{document_hash(model.document())};
      std::vector<std::string> undone;
      const std::vector<Made> sequence = any_sequence();
      ++sequences;
      longest = std::max(longest, sequence.size());
      for (const Made& made : sequence) {
        const auto submitted = model.submit(made.operation);
        const std::string hash = document_hash(model.document());
        if (!submitted || submitted->sequence == 0) {
          RC_ASSERT(hash == path.back());
          continue;
        }
        ++applied[made.name];
        const std::string broken = test::broken_invariant(model.document(), model.limits());
        if (!broken.empty()) RC_FAIL(std::string(made.name) + " left " + broken);
        if (made.operation.has_undo()) {
          undone.push_back(path.back());
          path.pop_back();
          RC_ASSERT(hash == path.back());
        } else if (made.operation.has_redo()) {
          RC_ASSERT(hash == undone.back());
          path.push_back(undone.back());
          undone.pop_back();
        } else {
          path.push_back(hash);
          undone.clear();
        }
      }
      RC_ASSERT(test::broken_round_trip(model) == "");
      while (path.size() > 1) {
        RC_ASSERT(model.submit(undo).ok());
        path.pop_back();
        RC_ASSERT(document_hash(model.document()) == path.back());
      }
      RC_ASSERT(!model.submit(undo).ok());
    }
  }));
  // The sequences must reach what they are meant to reach.
  EXPECT_GE(sequences, cases * sequences_per_case);
  EXPECT_GE(longest, static_cast<std::size_t>(longest_sequence - 4));
  for (const Maker& maker : own_makers) EXPECT_GT(applied[maker.name], sequences_per_case) << maker.name;
}

}  // namespace
}  // namespace handloft::model
