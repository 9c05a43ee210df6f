// Export of B-spline faces and of models with changed faces: valid for Open CASCADE, and what nobody touched
// is as it was.

#include <gtest/gtest.h>

#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepPrimAPI_MakeBox.hxx>
#include <algorithm>
#include <cmath>
#include <memory>

#include "server-model/exchange/cad_export.h"
#include "server-model/exchange/cad_import.h"
#include "server-model/exchange/iges_writer.h"
#include "server-model/exchange/step_reader.h"
#include "server-model/exchange/step_writer.h"
#include "tests/support/test_data.h"
#include "tests/unit/server-model/exchange/cad_models.h"

namespace handloft::exchange {
namespace {

using geometry::BSplineSurface;
using geometry::Vec3;

/// A bump in the middle that leaves the border and its tangents as they are, metres.
BSplineSurface with_bump(BSplineSurface surface, double height) {
  const int nu = surface.u.control_count();
  const int nv = surface.v.control_count();
  for (int i = 0; i < nu; ++i) {
    for (int j = 0; j < nv; ++j) {
      const auto shape = [](int k, int n) {
        const double x = std::clamp((k - 1.0) / (n - 3.0), 0.0, 1.0);
        return x * x * (1 - x) * (1 - x) * 16;
      };
      surface.control[surface.index(i, j)].z() += height * shape(i, nu) * shape(j, nv);
    }
  }
  return surface;
}

BSplineSurface lifted(BSplineSurface surface, double height) {
  for (Vec3& p : surface.control) p.z() += height;
  return surface;
}

ModelExport model_of(const ImportedModel& imported, const std::string& name = "model") {
  ModelExport model;
  model.name = name;
  model.boundary_representation = std::make_shared<const std::string>(imported.boundary_representation);
  model.metres_per_unit = imported.metres_per_unit;
  return model;
}

class CadExport : public ::testing::Test {
 protected:
  ImportedModel import(const std::filesystem::path& path) {
    auto model = import_cad_model(path);
    EXPECT_TRUE(model.ok()) << (model.ok() ? "" : model.error().describe());
    return model.ok() ? std::move(*model) : ImportedModel{};
  }
  ImportedModel import_step(const TopoDS_Shape& shape) {
    test::write_step_file(folder_.path() / "in.step", {shape});
    return import(folder_.path() / "in.step");
  }
  /// Writes, and reads what the file holds.
  StepContent step(const CadContent& content) {
    const Status written = write_step(step_, content);
    EXPECT_TRUE(written.ok()) << (written.ok() ? "" : written.error().describe());
    auto read = read_step(step_);
    EXPECT_TRUE(read.ok()) << (read.ok() ? "" : read.error().describe());
    return read.ok() ? *read : StepContent{};
  }
  StepContent iges(const CadContent& content) {
    const Status written = write_iges(iges_, content);
    EXPECT_TRUE(written.ok()) << (written.ok() ? "" : written.error().describe());
    auto read = read_iges(iges_);
    EXPECT_TRUE(read.ok()) << (read.ok() ? "" : read.error().describe());
    return read.ok() ? *read : StepContent{};
  }
  handloft::test::TemporaryDirectory folder_;
  std::filesystem::path step_ = folder_.path() / "out.step";
  std::filesystem::path iges_ = folder_.path() / "out.igs";
};

TEST_F(CadExport, FacesOfEveryKindAreValidInBothFormats) {
  std::vector<CadFace> faces;
  for (const TopoDS_Shape& shape :
       {TopoDS_Shape(BRepBuilderAPI_MakeFace(test::sheet(8, 40, 10), 1e-7).Face()),
        TopoDS_Shape(test::periodic_tube(30, 80)), TopoDS_Shape(test::rational_sphere(25)),
        TopoDS_Shape(test::sheet_with_two_holes(50, 5))}) {
    const ImportedModel model = import_step(shape);
    ASSERT_EQ(model.faces.size(), 1U);
    faces.push_back(model.faces[0].face);
  }
  faces[0].name = "sheet";
  faces[3].name = "holes";
  faces.push_back(faces[3]);
  faces.back().reversed = true;
  const double sphere = 4 * std::acos(-1.0) * 0.025 * 0.025;
  for (const StepContent& content : {step({{}, faces, {}}), iges({{}, faces, {}})}) {
    ASSERT_EQ(content.faces.size(), faces.size());
    EXPECT_TRUE(content.valid);
    for (const StepFace& face : content.faces) {
      EXPECT_TRUE(face.valid);
      EXPECT_TRUE(face.is_bspline);
      EXPECT_TRUE(face.has_pcurves);
    }
    EXPECT_EQ(content.faces[0].name, "sheet");
    EXPECT_EQ(content.faces[3].name, "holes");
    EXPECT_NEAR(content.faces[2].area_m2, sphere, 1e-6 * sphere);
    EXPECT_NEAR(content.faces[3].area_m2, content.faces[4].area_m2, 1e-12);
  }
}

TEST_F(CadExport, TrimsSurviveTheRoundTrip) {
  const ImportedModel model = import_step(test::sheet_with_two_holes(50, 5));
  ASSERT_EQ(model.faces.size(), 1U);
  const std::vector<CadFace> faces{model.faces[0].face};
  const StepContent before = *read_step(folder_.path() / "in.step");
  const StepContent after = step({{}, faces, {}});
  ASSERT_EQ(after.faces.size(), 1U);
  EXPECT_NEAR(after.faces[0].area_m2, before.faces[0].area_m2, 1e-8 * before.faces[0].area_m2);
  const ImportedModel again = import(step_);
  ASSERT_EQ(again.faces.size(), 1U);
  EXPECT_EQ(again.faces[0].face.loops.size(), 3U);
}

// Loops whose parts are the two sides of one seam and two poles, as the importer gives them for a sphere with
// a hole: the seam must be one edge again.
TEST_F(CadExport, ASeamWithinATrimStaysClosed) {
  ImportedModel model = import_step(test::periodic_tube(30, 80));
  ASSERT_EQ(model.faces.size(), 1U);
  CadFace face = model.faces[0].face;
  const auto line = [](double u0, double v0, double u1, double v1) {
    return TrimCurve{*geometry::KnotVector::open(1, {0, 0, 1, 1}), {{u0, v0}, {u1, v1}}, {}};
  };
  const double u0 = face.surface.u.lower();
  const double u1 = face.surface.u.upper();
  const double v0 = face.surface.v.lower() + 0.25 * face.surface.v.length();
  const double v1 = face.surface.v.lower() + 0.75 * face.surface.v.length();
  face.loops = {{line(u0, v0, u1, v0), line(u1, v0, u1, v1), line(u1, v1, u0, v1), line(u0, v1, u0, v0)}};
  const std::vector<CadFace> faces{face};
  const StepContent content = step({{}, faces, {}});
  ASSERT_EQ(content.faces.size(), 1U);
  EXPECT_TRUE(content.valid);
  const StepContent whole = *read_step(folder_.path() / "in.step");
  EXPECT_NEAR(content.faces[0].area_m2, 0.5 * whole.faces[0].area_m2, 1e-7 * whole.faces[0].area_m2);
}

TEST_F(CadExport, AModelKeepsItsOtherFacesAndStaysClosedWhenTheBorderHolds) {
  const ImportedModel model = import_step(test::box_with_freeform_top(100, 20));
  ASSERT_EQ(model.faces.size(), 1U);
  std::vector<ModelExport> models{model_of(model)};
  models[0].replaced.push_back({model.faces[0].number, with_bump(model.faces[0].face.surface, 0.01)});
  const StepContent before = *read_step(folder_.path() / "in.step");
  const StepContent after = step({{}, {}, models});
  EXPECT_TRUE(after.valid);
  ASSERT_EQ(after.faces.size(), 6U);
  const ImportedModel again = import(step_);
  ASSERT_EQ(again.faces.size(), 1U);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_TRUE(after.faces[i].valid);
    if (i + 1 == model.faces[0].number) {
      EXPECT_GT(after.faces[i].area_m2, before.faces[i].area_m2 + 1e-5);
      continue;
    }
    EXPECT_NEAR(after.faces[i].area_m2, before.faces[i].area_m2, 1e-12);
    ASSERT_EQ(after.faces[i].boundary.size(), before.faces[i].boundary.size());
    for (std::size_t k = 0; k < after.faces[i].boundary.size(); ++k) {
      EXPECT_NEAR((after.faces[i].boundary[k] - before.faces[i].boundary[k]).norm(), 0, 1e-12);
    }
  }
  EXPECT_EQ(after.closed_shells, 1U);
  EXPECT_EQ(after.solids, 1U);
  const StepContent in_iges = iges({{}, {}, models});
  EXPECT_TRUE(in_iges.valid);
  EXPECT_EQ(in_iges.faces.size(), 6U);
  const BSplineSurface& expected = models[0].replaced[0].surface;
  for (std::size_t i = 0; i < expected.control.size(); ++i) {
    EXPECT_NEAR((again.faces[0].face.surface.control[i] - expected.control[i]).norm(), 0, 1e-12);
  }
}

TEST_F(CadExport, AMovedBorderGetsEdgesOfItsOwn) {
  const ImportedModel model = import_step(test::box_with_freeform_top(100, 20));
  ASSERT_EQ(model.faces.size(), 1U);
  std::vector<ModelExport> models{model_of(model)};
  models[0].replaced.push_back({model.faces[0].number, lifted(model.faces[0].face.surface, 0.03)});
  for (const StepContent& content : {step({{}, {}, models}), iges({{}, {}, models})}) {
    EXPECT_TRUE(content.valid);
    ASSERT_EQ(content.faces.size(), 6U);
    EXPECT_EQ(content.solids, 0U) << "it is open now";
    EXPECT_EQ(content.closed_shells, 0U);
    double highest = 0;
    for (const StepFace& face : content.faces) {
      EXPECT_TRUE(face.valid);
      for (const Vec3& p : face.boundary) highest = std::max(highest, p.z());
    }
    EXPECT_NEAR(highest, 0.13, 1e-9);
  }
}

TEST_F(CadExport, SeamsAndPolesOfMovedFacesStayWhole) {
  for (const TopoDS_Face& shape : {test::periodic_tube(30, 80), test::rational_sphere(25)}) {
    const ImportedModel model = import_step(shape);
    ASSERT_EQ(model.faces.size(), 1U);
    std::vector<ModelExport> models{model_of(model)};
    BSplineSurface wide = model.faces[0].face.surface;
    for (Vec3& p : wide.control) p.head<2>() *= 2;
    models[0].replaced.push_back({1, wide});
    const StepContent content = step({{}, {}, models});
    EXPECT_TRUE(content.valid);
    ASSERT_EQ(content.faces.size(), 1U);
    EXPECT_TRUE(content.faces[0].valid);
  }
}

TEST_F(CadExport, UntouchedModelsComeBackAsTheyWere) {
  test::write_step_file(folder_.path() / "in.step",
                        {test::sheet_with_two_holes(50, 5), test::box_with_freeform_top(100, 20)});
  const ImportedModel model = import(folder_.path() / "in.step");
  ASSERT_EQ(model.faces.size(), 2U);
  std::vector<ModelExport> models{model_of(model)};
  // Faces that stand in other parameters, as sculpting keeps them, but that nobody changed.
  for (const ImportedFace& face : model.faces) {
    models[0].replaced.push_back({face.number, face.face.surface});
    std::vector<double> knots = face.face.surface.u.knots();
    for (double& knot : knots) knot *= 0.07;
    models[0].replaced.back().surface.u = *geometry::KnotVector::open(3, knots);
  }
  const StepContent written = step({{}, {}, models});
  EXPECT_EQ(written.closed_shells, 1U);
  const ImportedModel again = import(step_);
  ASSERT_EQ(again.faces.size(), 2U);
  for (std::size_t f = 0; f < 2; ++f) {
    const BSplineSurface& a = model.faces[f].face.surface;
    const BSplineSurface& b = again.faces[f].face.surface;
    EXPECT_EQ(model.faces[f].number, again.faces[f].number);
    ASSERT_EQ(a.control.size(), b.control.size());
    for (std::size_t i = 0; i < a.control.size(); ++i) {
      EXPECT_NEAR((a.control[i] - b.control[i]).norm(), 0, 1e-12);
    }
  }
  EXPECT_EQ(again.rest_indices, model.rest_indices);
}

TEST_F(CadExport, AStretchedDomainIsTheFormerOneAgain) {
  const ImportedModel model = import_step(test::sheet_with_two_holes(50, 5));
  ASSERT_EQ(model.faces.size(), 1U);
  std::vector<ModelExport> models{model_of(model)};
  BSplineSurface stretched = model.faces[0].face.surface;
  std::vector<double> knots = stretched.u.knots();
  for (double& knot : knots) knot = 7 + 0.05 * knot;
  stretched.u = *geometry::KnotVector::open(3, knots);
  models[0].replaced.push_back({1, stretched});
  const StepContent before = *read_step(folder_.path() / "in.step");
  const StepContent content = step({{}, {}, models});
  EXPECT_TRUE(content.valid);
  ASSERT_EQ(content.faces.size(), 1U);
  EXPECT_NEAR(content.faces[0].area_m2, before.faces[0].area_m2, 1e-9 * before.faces[0].area_m2);
}

TEST_F(CadExport, RemovedFacesAreLeftOutAndTheTranslationMovesAll) {
  const ImportedModel model = import_step(test::box_with_freeform_top(100, 20));
  std::vector<ModelExport> models{model_of(model)};
  models[0].removed = {model.faces[0].number};
  models[0].translation = {0, 0, 1};
  const StepContent content = step({{}, {}, models});
  EXPECT_TRUE(content.valid);
  ASSERT_EQ(content.faces.size(), 5U);
  for (const StepFace& face : content.faces) {
    EXPECT_FALSE(face.is_bspline);
    for (const Vec3& p : face.boundary) EXPECT_GT(p.z(), 0.99);
  }
  models[0].removed = {1, 2, 3, 4, 5, 6};
  EXPECT_EQ(write_step(step_, {{}, {}, models}).error().code, ErrorCode::failed_precondition);
}

TEST_F(CadExport, BadModelsAndFacesAreNamed) {
  const ImportedModel model = import_step(test::box_with_freeform_top(100, 20));
  const auto error_of = [&](auto change) {
    std::vector<ModelExport> models{model_of(model)};
    models[0].replaced.push_back({model.faces[0].number, model.faces[0].face.surface});
    change(models[0]);
    const Status written = write_step(step_, {{}, {}, models});
    EXPECT_FALSE(written.ok());
    return written.ok() ? Error{} : written.error();
  };
  EXPECT_EQ(error_of([](ModelExport& m) { m.replaced[0].number = 0; }).field, "models[0].replaced[0].number");
  EXPECT_EQ(error_of([](ModelExport& m) { m.replaced[0].number = 7; }).field, "models[0].replaced[0].number");
  const std::uint32_t plane = model.faces[0].number == 1 ? 2 : 1;
  EXPECT_EQ(error_of([&](ModelExport& m) { m.replaced[0].number = plane; }).field,
            "models[0].replaced[0].number");
  EXPECT_EQ(error_of([](ModelExport& m) { m.removed = {9}; }).field, "models[0].removed[0]");
  EXPECT_EQ(error_of([](ModelExport& m) { m.replaced[0].surface.control.pop_back(); }).code,
            ErrorCode::invalid_argument);
  EXPECT_EQ(error_of([](ModelExport& m) { m.replaced[0].surface.control[3].x() = std::nan(""); }).code,
            ErrorCode::invalid_argument);
  EXPECT_EQ(error_of([](ModelExport& m) { m.metres_per_unit = 0; }).code, ErrorCode::invalid_argument);
  EXPECT_EQ(error_of([](ModelExport& m) { m.boundary_representation = nullptr; }).code,
            ErrorCode::invalid_argument);
  EXPECT_EQ(error_of([](ModelExport& m) {
              m.boundary_representation = std::make_shared<const std::string>("HLBREP1\nnonsense");
            }).field,
            "models[0].boundary_representation");
  std::vector<CadFace> faces{model.faces[0].face};
  faces[0].loops = {{}};
  EXPECT_EQ(write_step(step_, {{}, faces, {}}).error().field, "faces[0].loops");
  faces[0].loops = {
      {TrimCurve{*geometry::KnotVector::open(1, {0, 0, 1, 1}), {{0, std::nan("")}, {1, 1}}, {}}}};
  EXPECT_EQ(write_step(step_, {{}, faces, {}}).error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(write_step(step_, CadContent{}).error().code, ErrorCode::invalid_argument);
}

}  // namespace
}  // namespace handloft::exchange
