// D6 - D14, D17, D21: what viewers are sent of sculpted surfaces and their icons.

#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <deque>
#include <numbers>

#include "common/codec/mesh_codec.h"
#include "server-model/model/model.h"
#include "server-model/model/sculpt_shape.h"
#include "server-model/stream/icons.h"
#include "server-model/stream/scene_builder.h"
#include "server-model/stream/viewer.h"

namespace handloft::stream {
namespace {

v1::Operation operation(const std::string& json) {
  v1::Operation message;
  const auto status = google::protobuf::util::JsonStringToMessage(json, &message);
  EXPECT_TRUE(status.ok()) << status.ToString() << "\n" << json;
  return message;
}

class StreamSculpt : public ::testing::Test {
 protected:
  void apply(const std::string& json) {
    const auto submitted = model_.submit(operation(json));
    ASSERT_TRUE(submitted.ok()) << json << "\n" << submitted.error().describe();
  }
  /// A sheet of 0.4 x 0.3 m, whose parameters are metres, held at its middle.
  void hood() {
    apply(R"({"create_sculpt_surface": {"id": "hood", "rectangle": {"width_m": 0.4, "depth_m": 0.3},
              "control_u": 12, "control_v": 10}})");
    apply(R"({"add_icon": {"entity": "hood", "id": "top", "shape": "ICON_POINT",
              "parameters": [{"x": 0.2, "y": 0.15}]}})");
  }
  void drag(double z) {
    apply(R"({"drag_icon": {"entity": "hood", "icon": "top", "translation": {"z": )" + std::to_string(z) +
          "}}}");
  }
  ScenePtr scene(std::span<const IconMark> marks = {}) {
    return builder_.build(model_, 0, {{}, {}, {marks.begin(), marks.end()}});
  }
  model::SculptPtr shape() const { return model::as_sculpt(model_.document().find("hood")); }
  static const v1::EntityState& only(const v1::Envelope& envelope) {
    return envelope.has_snapshot() ? envelope.snapshot().entities(0) : envelope.delta().changed(0);
  }

  model::Model model_;
  MeshCache meshes_{[](const std::function<void()>& job) { job(); }, [] {}};
  SceneBuilder builder_{7, meshes_};
};

TEST_F(StreamSculpt, the_mesh_lies_on_the_surface) {
  hood();
  drag(0.05);
  const ScenePtr now = scene();
  ASSERT_TRUE(now->entities.at("hood").surface);
  const auto mesh = codec::decode_mesh(*now->entities.at("hood").surface);
  ASSERT_TRUE(mesh.ok()) << mesh.error().describe();
  EXPECT_GE(mesh->indices.size() / 3, 2U * 64U * 64U) << "a flat sheet has triangles to bend";
  double highest = 0;
  for (std::size_t i = 0; i < mesh->positions.size(); ++i) {
    highest = std::max(highest, static_cast<double>(mesh->positions[i][2]));
    EXPECT_GT(mesh->normals[i][2], 0.0F);
  }
  EXPECT_NEAR(highest, 0.05, 1e-3);
}

TEST_F(StreamSculpt, D21_triangles_are_sent_once_for_a_drag) {
  hood();
  Viewer viewer;
  const auto first = viewer.next(*scene());
  ASSERT_TRUE(first);
  const v1::Mesh whole = only(*first).surface();
  ASSERT_FALSE(whole.indices().empty());
  ASSERT_NE(whole.topology(), 0U);

  const auto gesture = model_.begin_provisional(
      operation(R"({"drag_icon": {"entity": "hood", "icon": "top", "translation": {"z": 0.02}}})"));
  ASSERT_TRUE(gesture.ok()) << gesture.error().describe();
  const auto second = viewer.next(*scene());
  ASSERT_TRUE(second);
  const v1::Mesh& moved = only(*second).surface();
  EXPECT_TRUE(moved.indices().empty());
  EXPECT_EQ(moved.topology(), whole.topology());
  EXPECT_EQ(moved.index_count(), whole.index_count());
  EXPECT_NE(moved.residuals(), whole.residuals());
  EXPECT_FALSE(codec::decode_mesh(moved).ok()) << "they are not known to everybody";

  const auto before = codec::decode_mesh(whole);
  ASSERT_TRUE(before.ok());
  const auto after = codec::decode_mesh(moved, {}, {whole.topology(), before->indices});
  ASSERT_TRUE(after.ok()) << after.error().describe();
  EXPECT_EQ(after->indices, before->indices);
  EXPECT_FALSE(codec::decode_mesh(moved, {}, {whole.topology() + 1, before->indices}).ok());

  // Who joins later gets all of it.
  Viewer late;
  const auto joined = late.next(*scene());
  ASSERT_TRUE(joined);
  EXPECT_FALSE(only(*joined).surface().indices().empty());
  EXPECT_EQ(only(*joined).icons_size(), 1);
}

TEST_F(StreamSculpt, OlderViewersAreSentTheSameVerticesAsTheyReadThem) {
  hood();
  Viewer newer, older({}, MeshReading::vertex_streams);
  const auto compare = [&](const codec::KnownTriangles& known) {
    const auto now = newer.next(*scene()), then = older.next(*scene());
    EXPECT_TRUE(now && then);
    EXPECT_TRUE(only(*then).surface().residuals().empty());
    EXPECT_EQ(only(*then).surface().topology(), only(*now).surface().topology());
    auto a = codec::decode_mesh(only(*now).surface(), {}, known);
    const auto b = codec::decode_mesh(only(*then).surface(), {}, known);
    EXPECT_TRUE(a.ok() && b.ok());
    EXPECT_EQ(a->positions, b->positions);
    EXPECT_EQ(a->normals, b->normals);
    EXPECT_EQ(a->indices, b->indices);
    return std::pair{only(*now).surface().topology(), *std::move(a)};
  };
  const auto [topology, whole] = compare({});
  const auto gesture = model_.begin_provisional(
      operation(R"({"drag_icon": {"entity": "hood", "icon": "top", "translation": {"z": 0.02}}})"));
  ASSERT_TRUE(gesture.ok()) << gesture.error().describe();
  EXPECT_NE(compare({topology, whole.indices}).second.positions, whole.positions);
}

TEST_F(StreamSculpt, D17_icons_have_the_papers_colours_and_shapes) {
  hood();
  const auto add = [this](const std::string& rest) {
    apply(R"({"add_icon": {"entity": "hood", )" + rest + "}}");
  };
  add(R"("id": "slope", "shape": "ICON_POINT", "parameters": [{"x": 0.12, "y": 0.09}], "property": "ICON_TANGENT_U")");
  add(R"("id": "up", "shape": "ICON_POINT", "parameters": [{"x": 0.28, "y": 0.09}], "property": "ICON_NORMAL")");
  add(R"("id": "pull", "shape": "ICON_POINT", "parameters": [{"x": 0.28, "y": 0.21}], "role": "ICON_LOAD")");
  add(R"("id": "line", "shape": "ICON_CURVE", "parameters": [{"x": 0.04, "y": 0.03}, {"x": 0.36, "y": 0.03}])");
  add(R"("id": "patch", "shape": "ICON_REGION", "parameters": [{"x": 0.04, "y": 0.24}, {"x": 0.08, "y": 0.27}],
        "role": "ICON_LOAD")");
  add(R"("id": "off", "shape": "ICON_POINT", "parameters": [{"x": 0.08, "y": 0.15}], "state": "ICON_SLEEPING")");
  Viewer viewer;
  const auto message = viewer.next(*scene());
  ASSERT_TRUE(message);
  const v1::EntityState& state = only(*message);
  EXPECT_EQ(state.kind(), "sculpt_surface");
  EXPECT_TRUE(state.icons_shown());
  ASSERT_EQ(state.icons_size(), 7);
  const auto channel = [](const v1::Icon& icon, unsigned shift) {
    return icon.colour_rgba() >> shift & 0xFFU;
  };
  const auto& icons = state.icons();
  EXPECT_GT(channel(icons[0], 24), 2 * channel(icons[0], 16)) << "a position is red";
  EXPECT_FALSE(icons[0].has_direction());
  EXPECT_GT(channel(icons[1], 24), 2 * channel(icons[1], 8)) << "a derivative is yellow";
  EXPECT_GT(channel(icons[1], 16), 2 * channel(icons[1], 8));
  EXPECT_EQ(icons[1].label(), "R");
  EXPECT_NEAR(icons[1].direction().x(), 1, 1e-9) << "along u";
  EXPECT_EQ(icons[2].label(), "");
  EXPECT_NEAR(icons[2].direction().z(), 1, 1e-9) << "a normal is an arrow";
  EXPECT_GT(channel(icons[3], 16), channel(icons[3], 24)) << "a load is green";
  EXPECT_EQ(icons[4].colour_rgba(), icons[0].colour_rgba());
  EXPECT_EQ(icons[4].outline().size() % 12, 0U);
  EXPECT_GT(icons[4].outline().size(), 24U);
  EXPECT_EQ(icons[5].colour_rgba(), icons[3].colour_rgba());
  float corner = 0;
  std::memcpy(&corner, icons[5].outline().data(), sizeof corner);
  EXPECT_NEAR(corner, icons[0].place().x() - 0.4 * 0.4, 1e-6) << "u 0.1 of 0.4 m about the middle";
  EXPECT_NEAR(channel(icons[6], 24), channel(icons[6], 16), 32) << "what sleeps is grey";
}

TEST_F(StreamSculpt, icons_are_sent_when_they_changed) {
  hood();
  Viewer viewer;
  ASSERT_TRUE(viewer.next(*scene()));
  EXPECT_FALSE(viewer.next(*scene()));
  apply(R"({"rename": {"entity": "hood", "name": "Bonnet"}})");
  const auto renamed = viewer.next(*scene());
  ASSERT_TRUE(renamed);
  EXPECT_FALSE(only(*renamed).icons_shown()) << "as they were";
  EXPECT_EQ(only(*renamed).icons_size(), 0);

  const IconMark aimed{"hood", "top", IconMark::Kind::target};
  const auto marked = viewer.next(*scene({&aimed, 1}));
  ASSERT_TRUE(marked);
  ASSERT_EQ(only(*marked).icons_size(), 1);
  EXPECT_TRUE(only(*marked).icons(0).target());
  EXPECT_FALSE(only(*marked).icons(0).held());
  const IconMark elsewhere{"other", "top", IconMark::Kind::held};
  const auto cleared = viewer.next(*scene({&elsewhere, 1}));
  ASSERT_TRUE(cleared);
  EXPECT_FALSE(only(*cleared).icons(0).target());
  EXPECT_FALSE(only(*cleared).icons(0).held());

  drag(0.01);
  const auto moved = viewer.next(*scene());
  ASSERT_TRUE(moved);
  EXPECT_NEAR(only(*moved).icons(0).place().z(), 0.01, 1e-9);
  apply(R"({"delete_icon": {"entity": "hood", "icon": "top"}})");
  const auto gone = viewer.next(*scene());
  ASSERT_TRUE(gone);
  EXPECT_TRUE(only(*gone).icons_shown());
  EXPECT_EQ(only(*gone).icons_size(), 0);
}

/// Jobs run when the test says so.
struct LateCache {
  std::deque<std::function<void()>> jobs;
  int ready = 0;
  SculptCache cache{[this](std::function<void()> job) { jobs.push_back(std::move(job)); },
                    [this] { ++ready; }};

  void run_one() {
    auto job = std::move(jobs.front());
    jobs.pop_front();
    job();
  }
  std::shared_ptr<const v1::Mesh> ask(const model::SculptPtr& shape) {
    cache.begin_round();
    auto mesh = cache.find(shape, SculptCache::Moment::dragged);
    cache.end_round();
    return mesh;
  }
};

TEST_F(StreamSculpt, the_newest_of_many_frames_is_made_and_no_backlog) {
  hood();
  LateCache late;
  EXPECT_FALSE(late.ask(shape()));
  ASSERT_EQ(late.jobs.size(), 1U);
  late.run_one();
  const auto flat = late.ask(shape());
  ASSERT_TRUE(flat);
  EXPECT_TRUE(late.jobs.empty());
  for (int i = 1; i <= 20; ++i) {
    drag(0.001);
    EXPECT_EQ(late.ask(shape()), flat) << "the last that there is";
  }
  ASSERT_EQ(late.jobs.size(), 1U);
  late.run_one();
  EXPECT_EQ(late.cache.statistics().made, 2U);
  EXPECT_EQ(late.cache.statistics().pending, 0U);
  const auto bent = late.ask(shape());
  ASSERT_TRUE(bent);
  EXPECT_EQ(bent->topology(), flat->topology());
  const auto mesh = codec::decode_mesh(*bent);
  ASSERT_TRUE(mesh.ok());
  float highest = 0;
  for (const auto& place : mesh->positions) highest = std::max(highest, place[2]);
  EXPECT_NEAR(highest, 0.02, 1e-3);
}

TEST_F(StreamSculpt, what_is_gone_is_forgotten_while_it_is_made) {
  hood();
  LateCache late;
  EXPECT_FALSE(late.ask(shape()));
  late.cache.begin_round();
  late.cache.end_round();
  late.run_one();
  EXPECT_EQ(late.cache.statistics().made, 0U);
  EXPECT_EQ(late.cache.statistics().pending, 0U);
}

/// A face trimmed to a disk, from outside and turned over.
std::shared_ptr<model::SculptShape> disk(const model::SculptShape& sheet) {
  auto shape = std::make_shared<model::SculptShape>(sheet);
  model::TrimSpline rim{geometry::KnotVector::uniform(1, 41).value(), {}, {}};
  for (int i = 0; i <= 40; ++i) {
    const double angle = 2 * std::numbers::pi * i / 40;
    rim.control.emplace_back(0.2 + 0.12 * std::cos(angle), 0.15 + 0.09 * std::sin(angle));
  }
  rim.control.back() = rim.control.front();
  shape->trim = std::make_shared<const model::FaceTrim>(model::FaceTrim{{rim}});
  return shape;
}

TEST_F(StreamSculpt, a_trimmed_face_keeps_to_its_trim_and_follows_the_surface) {
  hood();
  const auto face = disk(*shape());
  auto mesher = SculptMesher::create(*face, 5);
  ASSERT_TRUE(mesher.ok()) << mesher.error().describe();
  drag(0.05);
  const auto packed = mesher->mesh(*shape()->surface);
  ASSERT_TRUE(packed.ok()) << packed.error().describe();
  const auto mesh = codec::decode_mesh(*packed);
  ASSERT_TRUE(mesh.ok());
  EXPECT_GT(mesh->indices.size() / 3, 1000U);
  EXPECT_LT(packed->residuals().size(), 3 * mesh->positions.size())
      << "in the order of refinement they take 8 each";
  for (const auto& [x, y, z] : mesh->positions) {
    EXPECT_LE(std::hypot(static_cast<double>(x) / 0.4, static_cast<double>(y) / 0.3), 0.3 + 1e-4);
    const geometry::Vec3 expected =
        shape()->surface->evaluate(static_cast<double>(x) + 0.2, static_cast<double>(y) + 0.15);
    EXPECT_NEAR(static_cast<double>(z), expected.z(), 1e-4) << "x and y stay where they were";
  }
  face->reversed = true;
  EXPECT_FALSE(mesher->fits(*face));
  auto other = SculptMesher::create(*face, 6);
  ASSERT_TRUE(other.ok());
  const auto turned = codec::decode_mesh(other->pack().value());
  ASSERT_TRUE(turned.ok());
  EXPECT_LT(turned->normals.front()[2], 0.0F);
}

TEST_F(StreamSculpt, very_large_surfaces_have_no_more_vertices_than_allowed) {
  hood();
  SculptMeshOptions options;
  options.least_parts = 1;
  for (const std::size_t most : {20U, 40U, 500U}) {  // Of 9 x 7 spans.
    options.max_vertices = most;
    const auto grid = sculpt_grid(*shape()->surface, options);
    ASSERT_TRUE(grid.ok()) << grid.error().describe();
    EXPECT_EQ(grid->us.front(), shape()->surface->u.lower());
    EXPECT_EQ(grid->us.back(), shape()->surface->u.upper());
    EXPECT_EQ(grid->vs.back(), shape()->surface->v.upper());
    EXPECT_LE((grid->us.size() - 1) * (grid->vs.size() - 1), most);
    EXPECT_GT(grid->us.size() * grid->vs.size(), most > 63 ? 63 : most / 3);
  }
}

TEST_F(StreamSculpt, numbers_that_are_not_finite_give_an_error) {
  hood();
  auto mesher = SculptMesher::create(*shape(), 1);
  ASSERT_TRUE(mesher.ok());
  geometry::BSplineSurface broken = *shape()->surface;
  broken.control[7].x() = std::nan("");
  EXPECT_FALSE(mesher->mesh(broken).ok());
  auto trimmed = SculptMesher::create(*disk(*shape()), 1);
  ASSERT_TRUE(trimmed.ok());
  for (geometry::Vec3& place : broken.control) place.x() = std::nan("");
  EXPECT_FALSE(trimmed->mesh(broken).ok());
}

}  // namespace
}  // namespace handloft::stream
