// Exports of a document (A26): what is written, what is refused, and that an old file survives a failure.

#include "server-model/session/export.h"

#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <memory>
#include <sstream>

#include "server-model/session/local_target.h"
#include "tests/support/test_data.h"
#include "tests/unit/server-model/model/model_helpers.h"

namespace handloft::model {
namespace {

namespace fs = std::filesystem;
using namespace test;

std::string content(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

class Exporting : public ::testing::Test {
 protected:
  FileAccess files() const {
    FileAccess access;
    access.write_folder = folder_.path();
    return access;
  }
  static v1::Export to(const std::string& path) {
    v1::Export request;
    request.set_path(path);
    return request;
  }
  handloft::test::TemporaryDirectory folder_;
  Document document_ = applied({}, {create("top"), add("top", saddle_points()), fit("top"), create("side")});
};

TEST_F(Exporting, WritesEachFormat) {
  for (const auto& [name, start] :
       {std::pair{"a.step", "ISO-10303-21;"}, std::pair{"a.STP", "ISO-10303-21;"}, std::pair{"a.igs", ""},
        std::pair{"a.glb", "glTF"}, std::pair{"a.obj", ""}}) {
    const auto exported = export_document(document_, to(name), files());
    ASSERT_TRUE(exported.ok()) << exported.error().describe();
    EXPECT_EQ(exported->entities, std::vector<std::string>{"top"});
    EXPECT_TRUE(content(folder_.path() / name).starts_with(start));
    EXPECT_GT(fs::file_size(folder_.path() / name), 1000U);
  }
}

TEST_F(Exporting, TheFormatMayBeNamed) {
  auto request = to("noextension");
  request.set_format(v1::Export::STEP);
  request.set_untrimmed(true);
  ASSERT_TRUE(export_document(document_, request, files()).ok());
  EXPECT_TRUE(content(folder_.path() / "noextension").starts_with("ISO-10303-21;"));
}

TEST_F(Exporting, RefusesWhatCannotBe) {
  const auto expect_refusal = [&](const v1::Export& request, ErrorCode code, const std::string& field) {
    const auto result = export_document(document_, request, files());
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().code, code) << result.error().describe();
    EXPECT_EQ(result.error().field, field) << result.error().describe();
  };
  expect_refusal(to(""), ErrorCode::invalid_argument, "export.path");
  expect_refusal(to(std::string("a\0.step", 7)), ErrorCode::invalid_argument, "export.path");
  expect_refusal(to("a.xyz"), ErrorCode::unsupported, "export.path");
  auto request = to("a.step");
  request.add_entities("nobody");
  expect_refusal(request, ErrorCode::not_found, "export.entities[0]");
  request.set_entities(0, "side");
  expect_refusal(request, ErrorCode::failed_precondition, "export.entities[0]");
  request = to("a.step");
  request.set_format(static_cast<v1::Export::Format>(99));
  expect_refusal(request, ErrorCode::invalid_argument, "export.format");
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

TEST_F(Exporting, AFolderThatIsMissingIsAnErrorAndLeavesNothing) {
  const auto result = export_document(document_, to("missing/a.step"), files());
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, ErrorCode::io);
  EXPECT_EQ(result.error().field, "export.path");
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

TEST_F(Exporting, AShapeThatAFormatCannotHoldIsNamed) {
  document_ = applied(document_, {create("far"), add("far", saddle_points()), fit("far")});
  auto far = std::make_shared<DualShape>(*document_.find_dual("far"));
  auto broken = std::make_shared<FittedSurface>(*far->fit);
  broken->frame.origin.x() = std::numeric_limits<double>::quiet_NaN();
  far->fit = broken;
  document_.entities["far"] = far;
  for (const char* name : {"a.step", "a.glb", "a.obj"}) {
    const auto result = export_document(document_, to(name), files());
    ASSERT_FALSE(result.ok()) << name;
    EXPECT_EQ(result.error().field, "export.entities") << name;
    EXPECT_TRUE(result.error().message.starts_with("\"far\": ")) << result.error().describe();
  }
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

// A22, A26: drawn by hand, fitted, and trimmed as the thinnest star there is.
TEST_F(Exporting, A22_A26_RealStrokesAsStarsMakeStepFiles) {
  HANDLOFT_REQUIRE_DATA(sketch, "tilt/sketch1.tilt");
  v1::Operation import;
  import.mutable_import_strokes()->set_entity("top");
  import.mutable_import_strokes()->set_path(sketch.string());
  for (const double exponent : {0.2, 0.3}) {
    for (const std::uint32_t degree : {1U, 2U, 6U}) {
      LocalTarget target(files());
      ASSERT_TRUE(target.submit(create("top")).ok());
      ASSERT_TRUE(target.submit(import).ok());
      v1::Operation fitted = fit("top");
      fitted.mutable_fit()->set_degree(degree);
      ASSERT_TRUE(target.submit(fitted).ok());
      v1::Operation shape;
      shape.mutable_set_superellipse()->set_entity("top");
      shape.mutable_set_superellipse()->set_exponent(exponent);
      ASSERT_TRUE(target.submit(shape).ok());
      const auto exported = export_document(target.model().document(), to("a.step"), files());
      EXPECT_TRUE(exported.ok()) << exponent << ", degree " << degree << ": "
                                 << (exported.ok() ? "" : exported.error().describe());
    }
  }
}

TEST_F(Exporting, AStaleSurfaceIsNoted) {
  document_ = applied(document_, {add("top", {point(0, 0, 0)})});
  const auto exported = export_document(document_, to("a.obj"), files());
  ASSERT_TRUE(exported.ok());
  EXPECT_EQ(exported->notes.size(), 1U);
}

TEST_F(Exporting, StaysWithinItsFolderWhereItMust) {
  FileAccess access = files();
  access.scope = FileAccess::Scope::within_folders;
  EXPECT_TRUE(export_document(document_, to("a.obj"), access).ok());
  for (const std::string& path :
       {std::string("../a.obj"), std::string("x/../../a.obj"), std::string("/tmp/a.obj")}) {
    const auto result = export_document(document_, to(path), access);
    ASSERT_FALSE(result.ok()) << path;
    EXPECT_EQ(result.error().code, ErrorCode::permission_denied);
  }
  fs::create_directory_symlink("/tmp", folder_.path() / "link");
  EXPECT_EQ(export_document(document_, to("link/a.obj"), access).error().code, ErrorCode::permission_denied);
}

// Who works from elsewhere could else replace whatever lies in the folder, as the users' roles.
TEST_F(Exporting, U2WritesNothingThatHasNotTheFormatsExtensionWhereItMustStay) {
  FileAccess access = files();
  access.scope = FileAccess::Scope::within_folders;
  std::ofstream(folder_.path() / "people.sqlite") << "Ann, Bob";
  for (const char* name : {"people.sqlite", "noextension", "a.obj"}) {
    auto request = to(name);
    request.set_format(v1::Export::STEP);
    const auto result = export_document(document_, request, access);
    ASSERT_FALSE(result.ok()) << name;
    EXPECT_EQ(result.error().code, ErrorCode::permission_denied) << result.error().describe();
    EXPECT_EQ(result.error().field, "export.path");
  }
  EXPECT_EQ(content(folder_.path() / "people.sqlite"), "Ann, Bob");
  auto request = to("a.STP");
  request.set_format(v1::Export::STEP);
  EXPECT_TRUE(export_document(document_, request, access).ok());
}

TEST_F(Exporting, D1NobodyWritesOverFilesOfTheServersOwn) {
  fs::create_directory(folder_.path() / "models");
  fs::create_directory_symlink(folder_.path() / "models", folder_.path() / "link");
  const fs::path store = folder_.path() / "seat.obj";
  std::ofstream(store) << "a model";
  fs::create_hard_link(store, folder_.path() / "again.obj");
  fs::create_symlink(store, folder_.path() / "soft.obj");
  for (const auto scope : {FileAccess::Scope::anywhere, FileAccess::Scope::within_folders}) {
    FileAccess access = files();
    access.scope = scope;
    access.own = {store, folder_.path() / "models"};
    for (const char* name : {"seat.obj", "./models/../seat.obj", "models/new.obj", "models/deep/new.obj",
                             "link/new.obj", "again.obj", "soft.obj"}) {
      const auto result = export_document(document_, to(name), access);
      ASSERT_FALSE(result.ok()) << name;
      EXPECT_EQ(result.error().code, ErrorCode::permission_denied) << result.error().describe();
      EXPECT_EQ(result.error().field, "export.path");
    }
    for (const char* name : {"seat.obj-wal", "seat.obj-shm", "seat.obj-mark", "seat.obj-journal"}) {
      auto request = to(name);
      request.set_format(v1::Export::OBJ);
      EXPECT_EQ(export_document(document_, request, access).error().code, ErrorCode::permission_denied)
          << name;
    }
    EXPECT_TRUE(export_document(document_, to("seat2.obj"), access).ok());
    EXPECT_TRUE(export_document(document_, to("models.obj"), access).ok());
  }
  EXPECT_EQ(content(store), "a model");
}

TEST_F(Exporting, ANameThatNoFileCanHaveIsRefusedAsSuch) {
  FileAccess access = files();
  access.own = {folder_.path() / "seat.handloft"};
  const auto result = export_document(document_, to(std::string(300, 'a') + ".obj"), access);
  ASSERT_FALSE(result.ok());
  EXPECT_NE(result.error().code, ErrorCode::permission_denied) << result.error().describe();
  EXPECT_NE(result.error().message.find("too long"), std::string::npos) << result.error().describe();
}

TEST_F(Exporting, ChangesNothingInTheModel) {
  LocalTarget target(files(), Model(document_));
  v1::Operation operation;
  *operation.mutable_export_() = to("a.obj");
  const auto outcome = target.submit(operation);
  ASSERT_TRUE(outcome.ok());
  EXPECT_EQ(outcome->sequence, 0U);
  EXPECT_EQ(outcome->entities, std::vector<std::string>{"top"});
  EXPECT_EQ(document_hash(target.model().document()), document_hash(document_));
}

}  // namespace
}  // namespace handloft::model
