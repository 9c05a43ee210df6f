// CAD models in and out of a document: what resolving reads from a file, and what an export of sculpted
// surfaces and models writes.

#include <gtest/gtest.h>

#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepBuilderAPI_Sewing.hxx>
#include <algorithm>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "server-model/exchange/cad_import.h"
#include "server-model/exchange/occt_bspline.h"
#include "server-model/exchange/step_reader.h"
#include "server-model/exchange/step_writer.h"
#include "server-model/model/bspline_message.h"
#include "server-model/model/cad_model.h"
#include "server-model/model/sculpt_shape.h"
#include "server-model/session/export.h"
#include "server-model/session/local_target.h"
#include "server-model/session/resolve_operation.h"
#include "tests/support/test_data.h"
#include "tests/unit/server-model/exchange/cad_models.h"

namespace handloft::model {
namespace {

namespace fs = std::filesystem;
namespace v1 = handloft::v1;
using geometry::BSplineSurface;
using geometry::KnotVector;
using geometry::Vec3;

/// A flat bicubic sheet of 6 x 6 control points, 60 mm wide, at `x`.
BSplineSurface sheet(double x) {
  BSplineSurface surface{*KnotVector::uniform(3, 6), *KnotVector::uniform(3, 6), {}, {}};
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) surface.control.emplace_back(x + 0.012 * i, 0.012 * j, 0.0);
  }
  return surface;
}

exchange::TrimCurve line(geometry::Vec2 from, geometry::Vec2 to) {
  return {*KnotVector::open(1, {0, 0, 1, 1}), {from, to}, {}};
}

/// A square within the parameters, a quarter of the sheet.
exchange::TrimLoops quarter() {
  return {{line({0.25, 0.25}, {0.75, 0.25}), line({0.75, 0.25}, {0.75, 0.75}),
           line({0.75, 0.75}, {0.25, 0.75}), line({0.25, 0.75}, {0.25, 0.25})}};
}

std::shared_ptr<SculptShape> sculpt(const std::string& id, BSplineSurface surface) {
  auto shape = std::make_shared<SculptShape>();
  shape->id = shape->name = id;
  shape->initial = shape->rest = shape->surface = std::make_shared<const BSplineSurface>(std::move(surface));
  return shape;
}

class CadModels : public ::testing::Test {
 protected:
  void SetUp() override {
    // Two faces, the second trimmed.
    const std::vector<exchange::CadFace> faces{{"whole", sheet(0), {}, false},
                                               {"part", sheet(0.1), quarter(), false}};
    ASSERT_TRUE(exchange::write_step(folder_.path() / "two.step", {{}, faces, {}}).ok());
    files_.read_folder = files_.write_folder = folder_.path();
    files_.scope = FileAccess::Scope::within_folders;
  }

  static v1::Operation import_of(const std::string& path) {
    v1::Operation operation;
    operation.mutable_import_model()->set_path(path);
    return operation;
  }

  /// The document after the import, as the model's operation makes it, less its parameters in metres.
  Document imported() {
    const auto resolved = resolve_operation(import_of("two.step"), files_);
    EXPECT_TRUE(resolved.ok()) << (resolved.ok() ? "" : resolved.error().describe());
    Document document;
    if (!resolved.ok()) return document;
    const v1::ResolvedModel& from = resolved->import_model().resolved();
    auto model = std::make_shared<CadModel>();
    model->id = model->name = "model-1";
    model->boundary_representation = std::make_shared<const std::string>(from.boundary_representation());
    model->metres_per_unit = from.metres_per_unit();
    for (const auto& face : from.faces()) {
      auto shape = sculpt("model-1.face-" + std::to_string(face.number()),
                          *read_surface(face.surface(), "surface", {}));
      auto trim = read_trim(face.loops(), "loops", {});
      EXPECT_TRUE(trim.ok());
      if (!trim->empty()) shape->trim = std::make_shared<const FaceTrim>(*trim);
      shape->model = model->id;
      shape->face = face.number();
      model->faces.push_back(shape->id);
      document.entities.insert_or_assign(shape->id, shape);
    }
    document.entities.insert_or_assign(model->id, model);
    return document;
  }

  exchange::StepContent exported(const Document& document, const std::vector<std::string>& ids,
                                 const std::vector<std::string>& expected) {
    v1::Export request;
    request.set_path("out.step");
    for (const std::string& id : ids) request.add_entities(id);
    const auto done = export_document(document, request, files_);
    EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().describe());
    if (!done.ok()) return {};
    EXPECT_EQ(done->entities, expected);
    auto content = exchange::read_step(done->path);
    EXPECT_TRUE(content.ok()) << (content.ok() ? "" : content.error().describe());
    return content.ok() ? *content : exchange::StepContent{};
  }

  handloft::test::TemporaryDirectory folder_;
  FileAccess files_;
};

TEST_F(CadModels, ResolvingReadsFacesWithTheirTrims) {
  v1::Operation operation = import_of("two.step");
  operation.mutable_import_model()->mutable_translation()->set_z(0.5);
  const auto resolved = resolve_operation(operation, files_);
  ASSERT_TRUE(resolved.ok()) << resolved.error().describe();
  const v1::ImportModel& request = resolved->import_model();
  EXPECT_EQ(request.path(), "");
  EXPECT_EQ(request.name(), "two");
  EXPECT_EQ(request.translation().z(), 0.5) << "it places the representation too";
  const v1::ResolvedModel& model = request.resolved();
  EXPECT_EQ(model.metres_per_unit(), 0.001);
  EXPECT_GT(model.boundary_representation().size(), 100U);
  EXPECT_FALSE(model.has_rest());
  ASSERT_EQ(model.faces_size(), 2);
  EXPECT_EQ(model.faces(0).number(), 1U);
  EXPECT_EQ(model.faces(0).name(), "whole");
  EXPECT_EQ(model.faces(0).loops_size(), 0);
  EXPECT_EQ(model.faces(1).loops_size(), 1);
  EXPECT_EQ(model.faces(1).loops(0).curves_size(), 4);
  const auto surface = read_surface(model.faces(0).surface(), "surface", {});
  ASSERT_TRUE(surface.ok());
  EXPECT_NEAR((surface->at(2, 3) - sheet(0).at(2, 3) - Vec3(0, 0, 0.5)).norm(), 0, 1e-12);
}

TEST_F(CadModels, ResolvingRefusesWhatIsNotAFileOfTheFolder) {
  const auto error_of = [&](const v1::Operation& operation) {
    const auto resolved = resolve_operation(operation, files_);
    EXPECT_FALSE(resolved.ok());
    return resolved.ok() ? Error{} : resolved.error();
  };
  std::ofstream(folder_.path() / "bad.step") << "no model\n";
  EXPECT_EQ(error_of(import_of("")).code, ErrorCode::invalid_argument);
  EXPECT_EQ(error_of(import_of("")).field, "import_model.path");
  EXPECT_EQ(error_of(import_of("missing.step")).code, ErrorCode::not_found);
  EXPECT_EQ(error_of(import_of("../two.step")).code, ErrorCode::permission_denied);
  EXPECT_EQ(error_of(import_of("bad.step")).code, ErrorCode::data_corrupt);
  EXPECT_EQ(error_of(import_of("bad.step")).field, "import_model.path");
  Limits small;
  small.max_model_faces = 1;
  EXPECT_EQ(resolve_operation(import_of("two.step"), files_, small).error().code,
            ErrorCode::resource_exhausted);
}

// The CAD kernel trusts the bytes of a stored model: they must not come from a client.
TEST_F(CadModels, AClientMayNotBringAStoredModel) {
  const auto resolved = resolve_operation(import_of("two.step"), files_);
  ASSERT_TRUE(resolved.ok());
  const auto again = resolve_operation(*resolved, files_);
  ASSERT_FALSE(again.ok());
  EXPECT_EQ(again.error().code, ErrorCode::permission_denied);
  EXPECT_EQ(again.error().field, "import_model.resolved");
  v1::Operation both = *resolved;
  both.mutable_import_model()->set_path("two.step");
  EXPECT_EQ(resolve_operation(both, files_).error().code, ErrorCode::permission_denied);
  FileAccess own;
  own.scope = FileAccess::Scope::anywhere;
  EXPECT_TRUE(resolve_operation(*resolved, own).ok());
}

TEST_F(CadModels, ExportsAModelWholeAndSurfacesBesideIt) {
  Document document = imported();
  auto alone = sculpt("surface-1", sheet(0.3));
  document.entities.insert_or_assign(alone->id, alone);
  const exchange::StepContent all = exported(document, {}, {"model-1", "surface-1"});
  EXPECT_TRUE(all.valid);
  EXPECT_EQ(all.faces.size(), 3U);
  EXPECT_EQ(exported(document, {"surface-1"}, {"surface-1"}).faces.size(), 1U);
  EXPECT_EQ(exported(document, {"model-1"}, {"model-1"}).faces.size(), 2U);
  // A face by itself keeps its trim; named with its model it is written once.
  const exchange::StepContent part = exported(document, {"model-1.face-2"}, {"model-1.face-2"});
  ASSERT_EQ(part.faces.size(), 1U);
  EXPECT_LT(part.faces[0].area_m2, 0.5 * 0.06 * 0.06);
  EXPECT_EQ(exported(document, {"model-1.face-2", "model-1"}, {"model-1"}).faces.size(), 2U);
}

TEST_F(CadModels, ExportsFacesAsTheyAreSculptedAndLeavesOutDeletedOnes) {
  Document document = imported();
  BSplineSurface raised = sheet(0);
  for (Vec3& p : raised.control) p.z() += 0.02;
  auto shape = std::make_shared<SculptShape>(*as_sculpt(document.entities.at("model-1.face-1")));
  shape->surface = std::make_shared<const BSplineSurface>(raised);
  document.entities.insert_or_assign(shape->id, shape);
  document.entities.erase("model-1.face-2");
  const exchange::StepContent content = exported(document, {}, {"model-1"});
  EXPECT_TRUE(content.valid);
  ASSERT_EQ(content.faces.size(), 1U);
  for (const Vec3& p : content.faces[0].samples) EXPECT_NEAR(p.z(), 0.02, 1e-12);
}

// Two sheets that share an edge in the file: lifted alike they share it still, else people are told.
TEST_F(CadModels, NeighboursThatCameApartAreToldByName) {
  BRepBuilderAPI_Sewing sewing(1e-6);
  for (const double x : {0.0, 0.06}) {
    const auto surface = exchange::detail::to_occt(sheet(x), exchange::detail::CadPlacement{});
    ASSERT_TRUE(surface.ok());
    sewing.Add(BRepBuilderAPI_MakeFace(*surface, 1e-7).Face());
  }
  sewing.Perform();
  exchange::test::write_step_file(folder_.path() / "two.step", {sewing.SewedShape()});
  Document document = imported();
  const auto lift = [&](const std::string& id, double height) {
    auto shape = std::make_shared<SculptShape>(*as_sculpt(document.entities.at(id)));
    BSplineSurface raised = *shape->surface;
    for (Vec3& p : raised.control) p.z() += height;
    shape->surface = std::make_shared<const BSplineSurface>(raised);
    document.entities.insert_or_assign(id, shape);
  };
  const auto notes_of = [&] {
    v1::Export request;
    request.set_path("out.step");
    const auto done = export_document(document, request, files_);
    EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().describe());
    return done.ok() ? done->notes : std::vector<std::string>{"failed"};
  };
  lift("model-1.face-1", 0.02);
  lift("model-1.face-2", 0.02);
  EXPECT_TRUE(notes_of().empty());
  EXPECT_EQ(exchange::read_step(folder_.path() / "out.step")->free_edges, 6U);
  lift("model-1.face-2", 0.0015);
  const std::vector<std::string> notes = notes_of();
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_EQ(notes[0],
            "\"model-1\": \"model-1.face-1\" and \"model-1.face-2\" came apart along their common "
            "edge, by up to 1.5 mm");
  EXPECT_EQ(exchange::read_step(folder_.path() / "out.step")->free_edges, 8U);
}

TEST_F(CadModels, MeshesOfSurfacesAndModels) {
  Document document = imported();
  auto model = std::make_shared<CadModel>(*as_cad_model(document.entities.at("model-1")));
  auto rest = std::make_shared<ReferenceMesh>();
  rest->positions = {{0, 0, 1}, {1, 0, 1}, {0, 1, 1}};
  rest->triangles = {{0, 1, 2}};
  model->rest = rest;
  document.entities.insert_or_assign(model->id, model);
  for (const char* name : {"out.obj", "out.glb", "out.igs"}) {
    v1::Export request;
    request.set_path(name);
    const auto done = export_document(document, request, files_);
    ASSERT_TRUE(done.ok()) << done.error().describe();
    EXPECT_GT(fs::file_size(done->path), 500U);
  }
  std::ifstream stream(folder_.path() / "out.obj");
  std::string line_of_file;
  std::size_t objects = 0;
  double area = 0;
  std::vector<Vec3> positions;
  while (std::getline(stream, line_of_file)) {
    if (line_of_file.starts_with("o ")) ++objects;
    if (line_of_file.starts_with("v ")) {
      Vec3 p;
      ASSERT_EQ(std::sscanf(line_of_file.c_str(), "v %lf %lf %lf", &p.x(), &p.y(), &p.z()), 3);
      positions.push_back(p);
    }
    unsigned a = 0;
    unsigned b = 0;
    unsigned c = 0;
    if (std::sscanf(line_of_file.c_str(), "f %u//%*u %u//%*u %u//%*u", &a, &b, &c) == 3) {
      const Vec3 u = positions.at(b - 1) - positions.at(a - 1);
      const Vec3 v = positions.at(c - 1) - positions.at(a - 1);
      area += 0.5 * (u.x() * v.y() - u.y() * v.x());
    }
  }
  EXPECT_EQ(objects, 3U) << "the rest and two faces";
  // Half a square metre, the sheet, and what its trim leaves of the other: all turned up.
  const exchange::StepContent part = exported(document, {"model-1.face-2"}, {"model-1.face-2"});
  ASSERT_EQ(part.faces.size(), 1U);
  EXPECT_NEAR(area, 0.5 + 0.06 * 0.06 + part.faces[0].area_m2, 1e-6);
}

TEST_F(CadModels, ADamagedModelIsNamed) {
  Document document = imported();
  auto model = std::make_shared<CadModel>(*as_cad_model(document.entities.at("model-1")));
  model->boundary_representation = std::make_shared<const std::string>("not a model");
  document.entities.insert_or_assign(model->id, model);
  v1::Export request;
  request.set_path("out.step");
  const auto done = export_document(document, request, files_);
  ASSERT_FALSE(done.ok());
  EXPECT_EQ(done.error().code, ErrorCode::data_corrupt);
  EXPECT_EQ(done.error().field, "export.entities");
  EXPECT_TRUE(done.error().message.starts_with("\"model-1\": ")) << done.error().message;
}

// The operation keeps surfaces in metres of their own parameters: what nobody changed must be known again.
TEST_F(CadModels, AModelThatNobodySculptedComesOutAsItWentIn) {
  std::vector<fs::path> paths{"two.step"};
  const fs::path real = "/usr/share/opencascade/data/step/linkrods.step";  // Of the package occt-misc.
  if (fs::exists(real)) paths.push_back(real);
  for (const fs::path& path : paths) {
    FileAccess own = files_;
    own.scope = FileAccess::Scope::anywhere;
    LocalTarget target(own);
    const auto imported = target.submit(import_of(path.string()));
    ASSERT_TRUE(imported.ok()) << imported.error().describe();
    v1::Operation operation;
    operation.mutable_export_()->set_path("out.step");
    const auto done = target.submit(operation);
    ASSERT_TRUE(done.ok()) << done.error().describe();
    exchange::StepReadOptions coarse;
    coarse.samples_per_side = coarse.samples_per_edge = 1;
    const auto before = exchange::read_step(path.is_absolute() ? path : folder_.path() / path, coarse);
    const auto after = exchange::read_step(folder_.path() / "out.step", coarse);
    ASSERT_TRUE(before.ok() && after.ok());
    EXPECT_EQ(after->solids, before->solids) << path;
    EXPECT_EQ(after->closed_shells, before->closed_shells) << path;
    EXPECT_TRUE(after->valid) << path;
    ASSERT_EQ(after->faces.size(), before->faces.size()) << path;
    for (std::size_t i = 0; i < after->faces.size(); ++i) {
      EXPECT_NEAR(after->faces[i].area_m2, before->faces[i].area_m2, 1e-12) << path << " face " << i + 1;
    }
  }
}

}  // namespace
}  // namespace handloft::model
