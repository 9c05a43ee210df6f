// Random sequences of icon operations (issue of sculpting; D6 - D20): none leaves NaN or breaks an invariant,
// undo gives back every document to the bit (A28), and redo and the replay of the log give the same bits
// (X2), whatever was kept between operations.

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "any_sculpting.h"
#include "document_invariants.h"
#include "server-model/model/canonical.h"
#include "server-model/model/model.h"
#include "server-model/model/sculpt_border.h"
#include "server-model/model/sculpt_solvers.h"
#include "state_round_trip.h"
#include "tests/support/build_kind.h"

namespace handloft::model {
namespace {

namespace v1 = handloft::v1;

/// Three for each of RapidCheck's 100 cases, of up to 40 operations, some 1 s; a sanitized build does a
/// third.
constexpr int sequences_per_case = handloft::test::sanitized ? 1 : 3;
constexpr int longest_sculpting = 40;

std::string any_sheet_id() {
  return *rc::gen::element<std::string>("s", "s", "s", "s", "t", "t", "surface-1", "s-model.face-1");
}

v1::Operation any_other(const char*& name) {
  v1::Operation operation;
  switch (test::in_range(0, 5)) {
    case 0: {
      name = "transform";
      auto& request = *operation.mutable_transform();
      request.add_entities(any_sheet_id());
      *request.mutable_translation() = test::any_vector(test::bad_sculpting_one_in);
      request.mutable_rotation()->set_w(1);
      request.mutable_rotation()->set_y(test::any_length(test::bad_sculpting_one_in));
      request.set_scale(*rc::gen::element(0.5, 0.9, 1.0, 1.25, 2.0));
      break;
    }
    case 1:
      name = "duplicate";
      operation.mutable_duplicate()->set_entity(any_sheet_id());
      *operation.mutable_duplicate()->mutable_translation() = test::any_vector(test::bad_sculpting_one_in);
      break;
    case 2:
      name = "undo";
      operation.mutable_undo();
      break;
    default:
      name = "redo";
      operation.mutable_redo();
  }
  return operation;
}

v1::Operation any_sculpting(const char*& name) {
  int total = 5;
  for (const auto& maker : test::sculpting_makers()) total += maker.weight;
  int pick = test::in_range(0, total);
  v1::Operation operation;
  for (const auto& maker : test::sculpting_makers()) {
    pick -= maker.weight;
    if (pick >= 0) continue;
    name = maker.name;
    maker.fill(any_sheet_id(), operation);
    return operation;
  }
  return any_other(name);
}

/// A tube of unevenly wide spans, closed along v: parameters (m) up to 0.3 and some 0.5, or 0 and a bit.
v1::Operation tube() {
  v1::Operation operation;
  auto& request = *operation.mutable_create_sculpt_surface();
  request.set_id("t");
  v1::BSplineSurface& surface = *request.mutable_surface();
  const int nu = test::in_range(5, 9), nv = test::in_range(4, 10);
  surface.set_degree_u(3);
  surface.set_degree_v(3);
  for (int i = 0; i < nu + 4; ++i) surface.add_knots_u(std::clamp(i - 3, 0, nu - 3));
  surface.set_periodic_v(true);
  for (int j = -3; j <= nv + 3; ++j) {
    const int turn = j < 0 ? -1 : j >= nv ? 1 : 0, at = j - turn * nv;
    surface.add_knots_v(turn * (nv + 1.0) + at + (at > 1 ? 1 : 0));  // The second span is twice as wide.
  }
  for (int i = 0; i < nu; ++i) {
    for (int j = 0; j < nv; ++j) {
      const double turn = 2 * 3.14159265358979 * j / nv;
      surface.add_control(0.3 * i / (nu - 1));
      surface.add_control(0.1 * std::cos(turn));
      surface.add_control(0.08 * std::sin(turn));
    }
  }
  return operation;
}

/// A sheet "s", and a sheet or a tube "t".
std::vector<v1::Operation> two_sheets() {
  std::vector<v1::Operation> operations;
  for (const char* id : {"s", "t"}) {
    v1::Operation operation;
    auto& request = *operation.mutable_create_sculpt_surface();
    request.set_id(id);
    request.mutable_rectangle()->set_width_m(0.3);
    request.mutable_rectangle()->set_depth_m(0.2);
    request.set_control_u(static_cast<std::uint32_t>(test::in_range(6, 11)));
    request.set_control_v(static_cast<std::uint32_t>(test::in_range(6, 11)));
    operations.push_back(operation);
  }
  if (test::in_range(0, 2) == 0) operations.back() = tube();
  return operations;
}

/// What the sequences came by: knots at borders, regions across a seam, held at places and by springs.
struct Reached {
  int borders = 0, across = 0, curves_across = 0, places = 0, springs = 0;

  void look(const SculptShape& shape) {
    for (const SculptIcon& icon : *shape.icons) {
      if (icon.shape == IconShape::point || !icon.acts()) continue;
      bool crosses = false;
      for (const geometry::Vec2& uv : icon.parameters)
        crosses = crosses || (shape.rest->v.is_periodic() && uv.y() > shape.rest->v.upper());
      if (icon.shape == IconShape::curve) {
        curves_across += crosses ? 1 : 0;
        continue;
      }
      across += crosses ? 1 : 0;
      if (icon.role != IconRole::constraint) continue;
      const RegionHold hold = region_hold(icon, *shape.rest);
      borders += hold == RegionHold::points && shape.rest->u.knots() != shape.initial->u.knots() ? 1 : 0;
      places += hold == RegionHold::places ? 1 : 0;
      springs += hold == RegionHold::spring ? 1 : 0;
    }
  }
};

TEST(SculptingSequences, D20X5X2KeepEveryInvariantUndoRedoAndReplayToTheBit) {
  std::map<std::string, int> applied;
  Reached reached;
  EXPECT_TRUE(rc::check([&] {
    for (int round = 0; round < sequences_per_case; ++round) {
      ApplyContext context;
      context.sculpt_solvers = std::make_shared<SculptSolvers>();
      Model model({}, context);
      std::vector<std::string> hashes;  // Of every step that can be undone.
      std::vector<v1::Operation> log;
      std::vector<v1::Operation> sequence = two_sheets();
      std::vector<const char*> names(sequence.size(), "create_sculpt_surface");
      for (int i = test::in_range(30, longest_sculpting - 1); i > 0; --i) {
        names.push_back("");
        sequence.push_back(any_sculpting(names.back()));
      }
      std::string hash = document_hash(model.document());
      for (std::size_t i = 0; i < sequence.size(); ++i) {
        const auto submitted = model.submit(sequence[i]);
        const std::string now = document_hash(model.document());
        if (!submitted || submitted->sequence == 0) {
          RC_ASSERT(now == hash);
          continue;
        }
        ++applied[names[i]];
        const std::string broken = test::broken_invariant(model.document(), model.limits());
        if (!broken.empty()) RC_FAIL(std::string(names[i]) + " left " + broken);
        for (const auto& [id, entity] : model.document().entities)
          if (const SculptPtr shape = as_sculpt(entity)) reached.look(*shape);
        log.push_back(submitted->effective);
        hash = now;
      }
      Model replayed;  // It keeps nothing between operations.
      for (const v1::Operation& each : log) RC_ASSERT(replayed.submit(each).ok());
      RC_ASSERT(document_hash(replayed.document()) == hash);
      RC_ASSERT(test::broken_round_trip(model) == "");

      v1::Operation undo, redo;
      undo.mutable_undo();
      redo.mutable_redo();
      while (model.history().undo_steps() > 0) {
        hashes.push_back(document_hash(model.document()));
        RC_ASSERT(model.submit(undo).ok());
      }
      RC_ASSERT(document_hash(model.document()) == document_hash(Document{}));
      for (; !hashes.empty(); hashes.pop_back()) {
        RC_ASSERT(model.submit(redo).ok());
        RC_ASSERT(document_hash(model.document()) == hashes.back());
      }
    }
  }));
  // The sequences must reach what they are meant to reach.
  for (const auto& maker : test::sculpting_makers())
    EXPECT_GT(applied[maker.name], 3 * sequences_per_case) << maker.name;
  for (const int times :
       {reached.borders, reached.across, reached.curves_across, reached.places, reached.springs})
    EXPECT_GE(times, sequences_per_case);
  for (const char* name : {"transform", "duplicate", "undo", "redo"})
    EXPECT_GE(applied[name], sequences_per_case) << name;
}

// The invariants above can fail: each is broken once.
TEST(SculptingInvariants, NoticeWhatIsBroken) {
  Model model;
  v1::Operation operation;
  auto& request = *operation.mutable_add_icon();
  request.set_entity("s");
  request.set_id("p");
  request.add_parameters()->set_x(0.15);
  request.mutable_parameters(0)->set_y(0.1);
  request.mutable_create()->mutable_rectangle()->set_width_m(0.3);
  request.mutable_create()->mutable_rectangle()->set_depth_m(0.2);
  ASSERT_TRUE(model.submit(operation).ok());
  operation.mutable_drag_icon()->set_entity("s");
  operation.mutable_drag_icon()->set_icon("p");
  operation.mutable_drag_icon()->mutable_translation()->set_z(0.02);
  ASSERT_TRUE(model.submit(operation).ok());
  const SculptPtr good = as_sculpt(model.document().find("s"));
  ASSERT_TRUE(good);
  ASSERT_EQ(test::broken_sculpt(*good), "");

  const auto with_point = [&](std::size_t index, double z) {
    SculptShape shape = *good;
    auto surface = std::make_shared<geometry::BSplineSurface>(*good->surface);
    surface->control[index].z() += z;
    shape.surface = surface;
    return test::broken_sculpt(shape);
  };
  const std::size_t middle = good->surface->control.size() / 2 + 3;
  EXPECT_NE(with_point(middle, std::nan("")), "");
  EXPECT_NE(with_point(middle, 1e-8), "");
  EXPECT_NE(with_point(0, 1e-15), "") << "a clamped corner";
  const auto with_icon = [&](auto change) {
    SculptShape shape = *good;
    auto icons = std::make_shared<std::vector<SculptIcon>>(*good->icons);
    change(icons->front());
    shape.icons = icons;
    return test::broken_sculpt(shape);
  };
  EXPECT_NE(with_icon([](SculptIcon& icon) { icon.translation.z() += 1e-8; }), "") << "D6";
  EXPECT_NE(with_icon([](SculptIcon& icon) { icon.place.x() += 1e-11; }), "") << "D14";
  EXPECT_NE(with_icon([](SculptIcon& icon) { icon.state = IconState::sleeping; }), "") << "D13";
  EXPECT_NE(with_icon([](SculptIcon& icon) { icon.parameters[0].x() = 7; }), "");
}

}  // namespace
}  // namespace handloft::model
