// Imports of .tilt files: read once, placed, and from then on part of the operation.

#include "server-model/session/resolve_operation.h"

#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <string>

#include "server-model/session/local_target.h"
#include "tests/support/test_data.h"
#include "tests/unit/server-model/model/model_helpers.h"

namespace handloft::model {
namespace {

using namespace test;

v1::Operation import_of(const std::string& path) {
  v1::Operation operation;
  operation.mutable_import_strokes()->set_entity("top");
  operation.mutable_import_strokes()->set_path(path);
  return operation;
}

TEST(ResolveOperation, LeavesOthersAlone) {
  const auto resolved = resolve_operation(create("top"), {});
  ASSERT_TRUE(resolved.ok());
  EXPECT_EQ(resolved->SerializeAsString(), create("top").SerializeAsString());
}

TEST(ResolveOperation, RealStrokesFitTheBoxAndKeepTheirPressure) {
  HANDLOFT_REQUIRE_DATA(sketch, "tilt/sketch1.tilt");
  v1::Operation operation = import_of(sketch.string());
  auto& request = *operation.mutable_import_strokes();
  request.set_box_m(0.1);
  request.mutable_centre()->set_z(0.2);
  const auto resolved = resolve_operation(operation, {});
  ASSERT_TRUE(resolved.ok()) << resolved.error().describe();
  const v1::ImportStrokes& strokes = resolved->import_strokes();
  EXPECT_EQ(strokes.path(), "");
  ASSERT_EQ(strokes.resolved_size(), 5);
  double lower[3] = {1, 1, 1};
  double upper[3] = {-1, -1, -1};
  int count = 0;
  bool varies = false;
  for (const auto& stroke : strokes.resolved()) {
    for (const auto& one : stroke.points()) {
      const double at[3] = {one.position().x(), one.position().y(), one.position().z()};
      for (int a = 0; a < 3; ++a) {
        lower[a] = std::min(lower[a], at[a]);
        upper[a] = std::max(upper[a], at[a]);
      }
      ++count;
      EXPECT_GE(one.pressure(), 0.0);
      EXPECT_LE(one.pressure(), 1.0);
      varies = varies || one.pressure() != strokes.resolved(0).points(0).pressure();
    }
  }
  EXPECT_EQ(count, 912);
  EXPECT_TRUE(varies);
  EXPECT_NEAR(std::max({upper[0] - lower[0], upper[1] - lower[1], upper[2] - lower[2]}), 0.1, 1e-12);
  EXPECT_NEAR((upper[2] + lower[2]) / 2, 0.2, 1e-12);
  EXPECT_NEAR((upper[0] + lower[0]) / 2, 0.0, 1e-12);

  // Chosen strokes and a scale of one's own.
  request.add_strokes(1);
  request.set_scale(0.01);
  const auto chosen = resolve_operation(operation, {});
  ASSERT_TRUE(chosen.ok());
  ASSERT_EQ(chosen->import_strokes().resolved_size(), 1);
  EXPECT_EQ(chosen->import_strokes().resolved(0).points_size(), strokes.resolved(1).points_size());
  request.add_strokes(5);
  EXPECT_EQ(resolve_operation(operation, {}).error().field, "import_strokes.strokes[1]");

  // The whole way into a model, as one step of history.
  LocalTarget target(FileAccess{});
  ASSERT_TRUE(target.submit(create("top")).ok());
  ASSERT_TRUE(target.submit(import_of(sketch.string())).ok());
  EXPECT_EQ(target.model().document().find_dual("top")->points.size(), 912U);
  EXPECT_EQ(target.model().document().find_dual("top")->stroke_count, 5U);
  EXPECT_EQ(target.model().history().undo_steps(), 2U);
}

TEST(ResolveOperation, RefusesMissingAndCorruptFiles) {
  handloft::test::TemporaryDirectory folder;
  FileAccess files;
  files.read_folder = folder.path();
  const Error missing = resolve_operation(import_of("missing.tilt"), files).error();
  EXPECT_EQ(missing.code, ErrorCode::not_found);
  EXPECT_EQ(missing.field, "import_strokes.path");
  std::ofstream(folder.path() / "bad.tilt") << "tilT and then nothing of use";
  const Error bad = resolve_operation(import_of("bad.tilt"), files).error();
  EXPECT_EQ(bad.code, ErrorCode::data_corrupt);
  EXPECT_EQ(bad.field, "import_strokes.path");
  EXPECT_TRUE(bad.message.starts_with("file.")) << bad.describe();
  files.scope = FileAccess::Scope::within_folders;
  EXPECT_EQ(resolve_operation(import_of("../bad.tilt"), files).error().code, ErrorCode::permission_denied);
}

TEST(ResolveOperation, SaysThatThePathIsMissing) {
  const Error error = resolve_operation(import_of(""), {}).error();
  EXPECT_EQ(error.code, ErrorCode::invalid_argument);
  EXPECT_EQ(error.field, "import_strokes.path");
  EXPECT_NE(error.message.find("path is missing"), std::string::npos) << error.message;
}

TEST(ResolveOperation, NamesTheBoundsOfTheScale) {
  HANDLOFT_REQUIRE_DATA(sketch, "tilt/sketch1.tilt");
  v1::Operation operation = import_of(sketch.string());
  for (const double scale : {1e300, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    operation.mutable_import_strokes()->set_scale(scale);
    const Error error = resolve_operation(operation, {}).error();
    EXPECT_EQ(error.field, "import_strokes.scale") << scale;
    EXPECT_NE(error.message.find("10000"), std::string::npos) << error.message;
  }
  // Allowed by itself, but not with these strokes.
  operation.mutable_import_strokes()->set_scale(9999);
  EXPECT_EQ(resolve_operation(operation, {}).error().field, "import_strokes.scale");
}

// A28: read once, in the world from then on, and the same wherever it is replayed.
TEST(ResolveOperation, A28_ReferenceStandsInTheOperation) {
  const handloft::test::TemporaryDirectory folder;
  std::ofstream(folder.path() / "wedge.obj") << "v 0 0 0\nv 1000 0 0\nv 0 0 -1000\nf 1 2 3\n";
  v1::Operation operation;
  v1::ImportReference& request = *operation.mutable_import_reference();
  request.set_path("wedge.obj");
  request.set_scale(0.001);
  request.set_y_up(true);
  request.mutable_translation()->set_z(0.5);
  FileAccess files;
  files.read_folder = folder.path();
  files.scope = FileAccess::Scope::within_folders;
  const auto resolved = resolve_operation(operation, files);
  ASSERT_TRUE(resolved.ok()) << resolved.error().describe();
  const v1::ImportReference& reference = resolved->import_reference();
  EXPECT_EQ(reference.path(), "");
  EXPECT_EQ(reference.name(), "wedge");
  EXPECT_EQ(reference.scale(), 0.0);
  EXPECT_FALSE(reference.y_up());
  EXPECT_FALSE(reference.has_translation());
  ASSERT_EQ(reference.resolved().positions_size(), 9);
  const std::vector<float> expected{0, 0, 0.5F, 1, 0, 0.5F, 0, 1, 0.5F};  // -z of the file is our +y.
  for (int i = 0; i < 9; ++i)
    EXPECT_FLOAT_EQ(reference.resolved().positions(i), expected[static_cast<std::size_t>(i)]);
  Model model;
  ASSERT_TRUE(model.submit(*resolved).ok());
  EXPECT_TRUE(model.document().find("reference-1"));

  request.set_path("../wedge.obj");
  EXPECT_EQ(resolve_operation(operation, files).error().code, ErrorCode::permission_denied);
  request.set_path("none.obj");
  EXPECT_EQ(resolve_operation(operation, files).error().describe(),
            "not_found: import_reference.path: none.obj: there is no such file");
  request.set_path("");
  EXPECT_EQ(resolve_operation(operation, files).error().field, "import_reference.path");
  request.set_path("wedge.obj");
  request.set_scale(-1);
  EXPECT_EQ(resolve_operation(operation, files).error().field, "import_reference.scale");
}

}  // namespace
}  // namespace handloft::model
